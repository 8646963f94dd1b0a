# which factors matter: a screening design (Plackett-Burman unless configured), its runs, the
# effects


checkpoint plan_screening:
    input:
        factors=FACTORS,
        table=user_file(SETTINGS.screening.design),
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/screening/design.csv",
        plan=f"{STUDY}/screening/plan.json",
    log:
        f"{STUDY}/logs/plan_screening.log",
    params:
        function="calibration.chain.screening:plan_screening",
        reads=[*PLANNING, "screening"],
        seeds=0,
    message:
        "plan the screening"
    script:
        "../scripts/task.py"


rule screening:
    input:
        design=f"{STUDY}/screening/design.csv",
        runs=runs_of("screening"),
        factors=FACTORS,
        measurements=measured,
    output:
        effects=f"{STUDY}/screening/effects.csv",
        anova=f"{STUDY}/screening/anova.csv",
        runs=f"{STUDY}/screening/runs.csv",
        summary=f"{STUDY}/screening/screening.json",
        further=each_further("screening/effects_{}.csv"),
        further_figures=each_further("screening/pareto_{}.svg"),
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
    params:
        function="calibration.chain.screening:screening",
        reads=[*RESPONSES, "factors", "screening", "ascent"],
    message:
        "screening: effects, ANOVA and the factors that go on"
    script:
        "../scripts/task.py"
