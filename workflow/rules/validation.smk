checkpoint plan_validation:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/validation/design.csv",
        plan=f"{STUDY}/validation/plan.json",
    log:
        f"{STUDY}/logs/plan_validation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the validation: replicates at the optimum"
    script:
        "../scripts/plan_validation.py"


rule validation:
    input:
        design=f"{STUDY}/validation/design.csv",
        target=TARGETS,
        runs=lambda w: results_of(checkpoints.plan_validation.get().output.plan),
    output:
        runs=f"{STUDY}/validation/runs.csv",
        summary=f"{STUDY}/validation/validation.json",
        further_figures=for_further_targets("validation/{}.svg", measured=True),
        figure=report(
            f"{STUDY}/validation/validation.svg",
            caption="../report/validation.rst",
            category="5 Validation",
        ),
    log:
        f"{STUDY}/logs/validation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "validation: replicates at the optimum against the measurement"
    script:
        "../scripts/validation.py"
