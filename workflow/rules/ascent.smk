checkpoint plan_ascent:
    input:
        screening=f"{STUDY}/screening/screening.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/ascent/design.csv",
        plan=f"{STUDY}/ascent/plan.json",
    log:
        f"{STUDY}/logs/plan_ascent.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the steepest ascent"
    script:
        "../scripts/plan_ascent.py"


rule ascent:
    input:
        design=f"{STUDY}/ascent/design.csv",
        target=TARGETS,
        runs=lambda w: results_of(checkpoints.plan_ascent.get().output.plan),
    output:
        runs=f"{STUDY}/ascent/runs.csv",
        summary=f"{STUDY}/ascent/ascent.json",
        path=report(
            f"{STUDY}/ascent/path.svg",
            caption="../report/ascent.rst",
            category="2 Steepest ascent",
        ),
    log:
        f"{STUDY}/logs/ascent.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "steepest ascent: the region's centre"
    script:
        "../scripts/ascent.py"
