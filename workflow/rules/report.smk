# the page, and a picture of each run of the chain for it

PICTURED = [STAGES[name].pictured for name in OWN if STAGES[name].pictured]


# seconds a stage, so one job draws them all
rule heaps:
    input:
        design=f"{STUDY}/{{stage}}/design.csv",
        runs=lambda w: runs_of(w.stage)(w),
    output:
        report(
            directory(f"{STUDY}/heaps/{{stage}}"),
            patterns=["{run}.webp"],
            caption="../report/heaps.rst",
            category="8 Heaps",
            subcategory="{stage}",
        ),
    benchmark:
        f"{STUDY}/logs/heaps_{{stage}}.tsv"
    wildcard_constraints:
        stage="|".join(PICTURED),
    params:
        function="calibration.telling.report.sheet:heaps",
        reads=[],
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
    output:
        page("report.html", "0 The whole study"),
    params:
        code="calibration.telling.report.build",
        declared=DECLARED,
        reads=["target"],
    message:
        "report: {output}"
    script:
        "../scripts/report.py"
