# draws of the posterior run in other experiments or rigs: what it leaves open there


checkpoint plan_push_through:
    input:
        machines=refusing(lambda: predicted(SETTINGS)),
        draws=f"{STUDY}/posterior/draws.csv",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("push_through"),
    params:
        function="calibration.chain.push_through:plan_push_through",
        reads=[*PLANNING, *TESTS, "predict"],
        seeds=5,
    message:
        "plan the draws of the posterior in other machines"
    script:
        "../scripts/task.py"


rule push_through:
    input:
        design=f"{STUDY}/push_through/design.csv",
        runs=runs_of("push_through"),
        measurements=MEASUREMENTS,
    output:
        summary=f"{STUDY}/push_through/push_through.json",
        metrics=f"{STUDY}/push_through/metrics.csv",
        shares=f"{STUDY}/push_through/shares.csv",
        runs=f"{STUDY}/push_through/runs.csv",
        figure=page(
            "push_through/push_through.svg", "5 What stays open, in other machines"
        ),
    params:
        function="calibration.chain.push_through:push_through",
        reads=["experiment", *TESTS, "measurements", "predict"],
    message:
        "what the posterior leaves open in other machines"
    script:
        "../scripts/task.py"
