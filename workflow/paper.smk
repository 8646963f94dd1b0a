# what concerns the paper alone, for a study that names one of these stages in its supplements

import paper.stages

# the paper's printed tables
TABLES = [user_file(path) for path in paper.stages.tables(STUDY_OBJECT)]
# of further studies, where they have been run: the validations that count beside this one, and the
# screenings of this one at other seeds
BESIDE, REPEATS = (
    [f"{RESULTS}{path.removeprefix(SETTINGS.results)}" for path in files]
    for files in paper.stages.further(STUDY_OBJECT)
)
# the claim of 1.2, where the study makes it or has made it
SCALED = (
    [rules.scaling.output.summary]
    if "scaling" in SETTINGS.supplements
    or (STUDY_OBJECT.folder / "scaling" / "scaling.json").exists()
    else []
)


rule audit:
    input:
        tables=TABLES,
    output:
        table=f"{STUDY}/audit/audit.csv",
        page=page("audit/audit.html", "12 Audit of the paper", captions="report"),
    params:
        function="paper.audit:audit",
        reads=[],
    message:
        "audit: recompute every printed figure of the paper"
    script:
        "scripts/task.py"


rule reproduction:
    input:
        tables=TABLES,
        settings=user_file(paper.stages.SETTINGS),
        beside=BESIDE,
        repeats=REPEATS,
        validation=f"{STUDY}/validation/validation.json",
        tilt=f"{STUDY}/tilt/tilt.json",
        drop=f"{STUDY}/drop/drop.json",
        shear=f"{STUDY}/shear/shear.json",
        scaling=SCALED,
    output:
        table=page(
            "reproduction/reproduction.csv", "10 Reproduction", captions="report"
        ),
        summary=f"{STUDY}/reproduction/reproduction.json",
    params:
        function="paper.reproduction.table:reproduction",
        reads=[],
    message:
        "reproduction: the paper's results beside this study's values"
    script:
        "scripts/task.py"


complete()
