# the tests on the laboratory's bench as virtual experiments. Tilted plane and drop: a sweep of one
# parameter, runs at the inverse of its fit for the measured value, and the fit


for TEST in ("tilt", "drop"):

    checkpoint:
        name:
            f"plan_{TEST}"
        input:
            needs=refusing(lambda test=TEST: swept_test(SETTINGS, test)),
            factors=FACTORS,
        output:
            **planned(TEST),
        params:
            function=f"calibration.stages.bench_tests:plan_{TEST}",
            reads=[*PLANNING, *TESTS],
        message:
            f"plan the {TEST} test: sweep"
        script:
            "../scripts/task.py"

    checkpoint:
        name:
            f"plan_{TEST}_confirmation"
        input:
            sweep=f"{STUDY}/{TEST}/design.csv",
            runs=runs_of(TEST),
            factors=FACTORS,
            measurements=MEASUREMENTS,
        output:
            **planned(f"{TEST}_confirmation"),
        params:
            function=f"calibration.stages.bench_tests:plan_{TEST}_confirmation",
            reads=[*PLANNING, *TESTS, "measurements"],
        message:
            f"plan the {TEST} test: runs at the inverse of the fit"
        script:
            "../scripts/task.py"

    rule:
        name:
            TEST
        input:
            sweep=f"{STUDY}/{TEST}/design.csv",
            confirmation=f"{STUDY}/{TEST}_confirmation/design.csv",
            runs=runs_of(f"{TEST}_confirmation"),
            factors=FACTORS,
            measurements=MEASUREMENTS,
        output:
            summary=f"{STUDY}/{TEST}/{TEST}.json",
            runs=f"{STUDY}/{TEST}/runs.csv",
            figure=page(f"{TEST}/{TEST}.svg", "7 Bench tests"),
        params:
            function=f"calibration.stages.bench_tests:{TEST}",
            reads=[*PLANNING, *TESTS, "measurements"],
        message:
            f"{TEST} test: fit, inverse and confirmation"
        script:
            "../scripts/task.py"


# in the form of the configuration's `fixed`; the heaps take it with `fixed_from: bench`
rule bench_parameters:
    input:
        tilt=f"{STUDY}/tilt/tilt.json",
        drop=f"{STUDY}/drop/drop.json",
        shear=f"{STUDY}/shear/shear.json",
    output:
        fixed=f"{STUDY}/bench/fixed.json",
    params:
        function="calibration.stages.bench_tests:bench_parameters",
        reads=[],
    message:
        "collect what the bench tests found"
    script:
        "../scripts/task.py"
