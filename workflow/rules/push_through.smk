# draws of a posterior, of one test or of all, run in other experiments or rigs: what it leaves open

for OF, DRAWS, SEEDS in (("", "posterior", 5), ("joint_", "joint", 8)):

    checkpoint:
        name:
            f"plan_{OF}push_through"
        input:
            machines=refusing(lambda: predicted(SETTINGS)),
            draws=f"{STUDY}/{DRAWS}/draws.csv",
            factors=FACTORS,
            fixed=BENCH_VALUES,
        output:
            **planned(f"{OF}push_through"),
        params:
            function=f"calibration.stages.push_through:plan_{OF}push_through",
            reads=[*PLANNING, *TESTS, "predict"],
            seeds=SEEDS,
        message:
            "plan draws of the posterior in other machines"
        script:
            "../scripts/task.py"

    rule:
        name:
            f"{OF}push_through"
        input:
            design=f"{STUDY}/{OF}push_through/design.csv",
            runs=runs_of(f"{OF}push_through"),
            measurements=MEASUREMENTS,
        output:
            summary=f"{STUDY}/{OF}push_through/{OF}push_through.json",
            metrics=f"{STUDY}/{OF}push_through/metrics.csv",
            runs=f"{STUDY}/{OF}push_through/runs.csv",
            figure=page(
                f"{OF}push_through/push_through.svg",
                "5 What stays open, in other machines",
            ),
        params:
            function=f"calibration.stages.push_through:{OF}push_through",
            reads=["experiment", *TESTS, "measurements", "predict"],
        message:
            "what the posterior leaves open in other machines"
        script:
            "../scripts/task.py"
