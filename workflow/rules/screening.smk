# which factors matter: a screening design (Plackett-Burman unless configured), its runs, the
# effects


checkpoint plan_screening:
    input:
        factors=FACTORS,
        table=user_file(SETTINGS.screening.design),
        fixed=BENCH_VALUES,
        again=again("plan_screening"),
    output:
        design=f"{STUDY}/screening/design.csv",
        plan=f"{STUDY}/screening/plan.json",
    log:
        f"{STUDY}/logs/plan_screening.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.screening:plan_screening",
        reads=["seed", "experiment", "fixed", "run", "factors", "screening"],
        seeds=0,
        made_from=made_from("plan_screening"),
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
        again=again("screening"),
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
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.screening:screening",
        reads=[
            "factors",
            "screening",
            "ascent",
            "target",
            "further_targets",
            "measurements",
            "experiment",
            "run",
        ],
        made_from=made_from("screening"),
    message:
        "screening: effects, ANOVA and the factors that go on"
    script:
        "../scripts/task.py"
