# which factors matter: a screening design (Plackett-Burman unless configured), its runs, the
# effects


checkpoint plan_screening:
    input:
        factors=FACTORS,
        table=user_file(SETTINGS.screening.design),
        fixed=BENCH_VALUES,
    output:
        **planned("screening"),
    params:
        function="calibration.stages.screening:plan_screening",
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
        half_normal=page("screening/half_normal.svg", "1 Screening"),
        pareto=page("screening/pareto.svg", "1 Screening"),
    params:
        function="calibration.stages.screening:screening",
        reads=[*RESPONSES, "factors", "screening", "ascent"],
    message:
        "screening: effects, ANOVA and the factors that go on"
    script:
        "../scripts/task.py"
