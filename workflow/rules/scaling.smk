rule plan_scaling:
    input:
        factors=SETTINGS.factors,
    output:
        design=f"{STUDY}/scaling/design.csv",
        plan=f"{STUDY}/scaling/plan.json",
    log:
        f"{STUDY}/logs/plan_scaling.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the scaling test: heap and drop, enlarged by two rules"
    script:
        "../scripts/plan_scaling.py"


rule scaling:
    input:
        design=f"{STUDY}/scaling/design.csv",
        runs=batches_of("scaling"),
    output:
        runs=f"{STUDY}/scaling/runs.csv",
        table=f"{STUDY}/scaling/scaling.csv",
        summary=f"{STUDY}/scaling/scaling.json",
        figure=report(
            f"{STUDY}/scaling/scaling.svg",
            caption="../report/scaling.rst",
            category="7 Bench tests",
        ),
    log:
        f"{STUDY}/logs/scaling.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "scaling test: angle and rebound against scale, and the paper's statements"
    script:
        "../scripts/scaling.py"
