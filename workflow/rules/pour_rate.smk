# the response over the rate of the pour, and out of the opened funnel


checkpoint plan_pour_rate:
    input:
        needs=needs("pour_rate", "plan_pour_rate"),
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/pour_rate/design.csv",
        plan=f"{STUDY}/pour_rate/plan.json",
    log:
        f"{STUDY}/logs/plan_pour_rate.log",
    params:
        function="calibration.chain.pour_rate:plan_pour_rate",
        reads=[*PLANNING, "pour_rate"],
        seeds=6,
    message:
        "plan heaps at other pour rates"
    script:
        "../scripts/task.py"


rule pour_rate:
    input:
        needs=needs("pour_rate", "pour_rate"),
        design=f"{STUDY}/pour_rate/design.csv",
        runs=runs_of("pour_rate"),
    output:
        summary=f"{STUDY}/pour_rate/pour_rate.json",
        table=f"{STUDY}/pour_rate/rates.csv",
        runs=f"{STUDY}/pour_rate/runs.csv",
        figure=report(
            f"{STUDY}/pour_rate/pour_rate.svg",
            caption="../report/pour_rate.rst",
            category="7 Pour rate",
        ),
    log:
        f"{STUDY}/logs/pour_rate.log",
    params:
        function="calibration.chain.pour_rate:pour_rate",
        reads=["target", "experiment", "run", "pour_rate"],
    message:
        "the response over the pour rate"
    script:
        "../scripts/task.py"
