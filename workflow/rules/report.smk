# the page, and a picture of each run of the chain for it

PICTURED = [stage.pictured for stage in STAGES.values() if stage.pictured]
# what the page shows too when it has been made, but does not wait for
ALSO_SHOWN = set(STAGES) - {
    *SETTINGS.supplements,
    *PICTURED,
    "optimise",
    "export",
    "provenance",
}


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
        validation=f"{STUDY}/validation/validation.json",
        heaps=expand(f"{STUDY}/heaps/{{stage}}", stage=PICTURED),
        # a supplement's name is that of its last rule, unless it says another
        supplements=lambda w: [
            getattr(rules, STAGES[name].rule).output[0]
            for name in SETTINGS.supplements
        ],
        exports=rules.export.output,
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
        # with its time: the page is written anew when it changes. It is no input, as that would
        # make what nobody asked for
        beside=lambda w: {
            str(path): int(path.stat().st_mtime)
            for name in sorted(ALSO_SHOWN)
            for path in sorted((STUDY_OBJECT.folder / name).glob("*.*"))
        },
    message:
        "report: {output}"
    script:
        "../scripts/report.py"
