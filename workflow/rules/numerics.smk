checkpoint plan_numerics:
    input:
        study="config/numerics.yaml",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/numerics/design.csv",
        plan=f"{STUDY}/numerics/plan.json",
    log:
        f"{STUDY}/logs/plan_numerics.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the study of resolution, time step, modulus and rolling law"
    script:
        "../scripts/plan_numerics.py"


rule numerics:
    input:
        design=f"{STUDY}/numerics/design.csv",
        runs=lambda w: results_of(checkpoints.plan_numerics.get().output.plan),
    output:
        table=f"{STUDY}/numerics/numerics.csv",
        figure=report(
            f"{STUDY}/numerics/numerics.svg",
            caption="../report/numerics.rst",
            category="11 Numerics",
        ),
    log:
        f"{STUDY}/logs/numerics.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "numerics: what the numerical choices cost in degrees"
    script:
        "../scripts/numerics.py"
