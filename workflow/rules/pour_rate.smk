# the response over the rate of the pour, and out of the opened funnel


checkpoint plan_pour_rate:
    input:
        needs=needs("pour_rate", "plan_pour_rate"),
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("pour_rate"),
    params:
        function="calibration.stages.pour_rate:plan_pour_rate",
        reads=[*PLANNING, "pour_rate"],
        seeds=6,
    message:
        "plan heaps at other pour rates"
    script:
        "../scripts/task.py"


rule pour_rate:
    input:
        design=f"{STUDY}/pour_rate/design.csv",
        runs=runs_of("pour_rate"),
    output:
        summary=f"{STUDY}/pour_rate/pour_rate.json",
        table=f"{STUDY}/pour_rate/rates.csv",
        runs=f"{STUDY}/pour_rate/runs.csv",
        figure=page("pour_rate/pour_rate.svg", "7 Pour rate"),
    params:
        function="calibration.stages.pour_rate:pour_rate",
        reads=["target", "experiment", "own_run", "pour_rate"],
    message:
        "the response over the pour rate"
    script:
        "../scripts/task.py"
