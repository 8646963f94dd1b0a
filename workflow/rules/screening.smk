# the screening's design follows from the configuration alone; it is planned when it first is needed
checkpoint plan_screening:
    input:
        factors=SETTINGS.factors,
        table=SETTINGS.screening.design or [],
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/screening/design.csv",
        plan=f"{STUDY}/screening/plan.json",
    log:
        f"{STUDY}/logs/plan_screening.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the screening"
    script:
        "../scripts/plan_screening.py"


rule screening:
    input:
        design=f"{STUDY}/screening/design.csv",
        factors=SETTINGS.factors,
        runs=lambda w: results_of(checkpoints.plan_screening.get().output.plan),
    output:
        effects=f"{STUDY}/screening/effects.csv",
        anova=f"{STUDY}/screening/anova.csv",
        runs=f"{STUDY}/screening/runs.csv",
        summary=f"{STUDY}/screening/screening.json",
        further=for_further_targets("screening/effects_{}.csv"),
        further_figures=for_further_targets("screening/pareto_{}.svg"),
        half_normal=report(
            f"{STUDY}/screening/half_normal.svg",
            caption="../report/half_normal.rst",
            category="1 Screening",
        ),
        pareto=report(
            f"{STUDY}/screening/pareto.svg",
            caption="../report/pareto.rst",
            category="1 Screening",
        ),
    log:
        f"{STUDY}/logs/screening.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "screening: effects, ANOVA and the factors that go on"
    script:
        "../scripts/screening.py"
