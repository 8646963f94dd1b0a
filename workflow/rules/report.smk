# the page, and a picture of each run of the chain for it

PICTURED = [stage.pictured for stage in STAGES.values() if stage.pictured]
CHAIN = ["screening", "ascent", "response_surface", "optimise", "validation", "export"]


def shown(wildcards):
    """What the page waits for and shows: what the rules of the chain and of the supplements leave,
    plans among it."""
    stages = [STAGES[name] for name in (*CHAIN, *SETTINGS.supplements)]
    names = [rule for stage in stages for rule in stage.rules(SETTINGS)]
    return [file for name in names for file in getattr(rules, name).output]


def also_shown(wildcards):
    """What the page shows too where it has been made: the files of the other stages, by absolute
    paths, of which snakemake knows no rule. It makes nothing that nobody asked for."""
    if STORED:
        return []
    others = set(STAGES) - {*CHAIN, *SETTINGS.supplements, "provenance"}
    folders = {folder for name in others for folder in STAGES[name].folders}
    found = (STUDY_OBJECT.folder.joinpath(f).glob("*.*") for f in sorted(folders))
    return [local(str(path.resolve())) for paths in found for path in sorted(paths)]


# seconds a stage, so one job draws them all
rule heaps:
    input:
        design=f"{STUDY}/{{stage}}/design.csv",
        runs=lambda w: runs_of(w.stage)(w),
        again=again("heaps"),
    output:
        report(
            directory(f"{STUDY}/heaps/{{stage}}"),
            patterns=["{run}.webp"],
            caption="../report/heaps.rst",
            category="8 Heaps",
            subcategory="{stage}",
        ),
    log:
        f"{STUDY}/logs/heaps_{{stage}}.log",
    wildcard_constraints:
        stage="|".join(PICTURED),
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="calibration.telling.report.pictures:heaps",
        reads=[],
        made_from=made_from("heaps"),
    message:
        "heaps: a picture of each run of {wildcards.stage}"
    script:
        "../scripts/task.py"


# made from whatever stages have finished; `all` makes the chain and the configured supplements
# first
rule report:
    input:
        shown=shown,
        also=also_shown,
        heaps=expand(f"{STUDY}/heaps/{{stage}}", stage=PICTURED),
        again=again("report"),
    output:
        report(
            f"{STUDY}/report.html",
            caption="../report/report.rst",
            category="0 The whole study",
        ),
    log:
        f"{STUDY}/logs/report.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        declared=DECLARED,
        made_from=made_from(
            "report", ["target"], ["calibration.telling.report.build", *DECLARED]
        ),
    message:
        "report: {output}"
    script:
        "../scripts/report.py"
