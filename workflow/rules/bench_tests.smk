# the tests on the laboratory's bench as virtual experiments. Tilted plane and drop: a sweep of one
# parameter, runs at the inverse of its fit for the measured value, and the fit. Direct shear: the
# yield locus


checkpoint plan_tilt:
    input:
        needs=refusing(lambda: swept_test(SETTINGS, "tilt")),
        factors=FACTORS,
    output:
        **planned("tilt"),
    params:
        function="calibration.chain.bench_tests.sweep:plan_tilt",
        reads=[*PLANNING, *TESTS],
    message:
        "plan the tilt test: sweep"
    script:
        "../scripts/task.py"


checkpoint plan_tilt_confirmation:
    input:
        sweep=f"{STUDY}/tilt/design.csv",
        runs=runs_of("tilt"),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        **planned("tilt_confirmation"),
    params:
        function="calibration.chain.bench_tests.sweep:plan_tilt_confirmation",
        reads=[*PLANNING, *TESTS, "measurements"],
    message:
        "plan the tilt test: runs at the inverse of the fit"
    script:
        "../scripts/task.py"


rule tilt:
    input:
        sweep=f"{STUDY}/tilt/design.csv",
        confirmation=f"{STUDY}/tilt_confirmation/design.csv",
        runs=runs_of("tilt_confirmation"),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        summary=f"{STUDY}/tilt/tilt.json",
        runs=f"{STUDY}/tilt/runs.csv",
        figure=page("tilt/tilt.svg", "7 Bench tests"),
    params:
        function="calibration.chain.bench_tests.sweep:tilt",
        reads=[*PLANNING, *TESTS, "measurements"],
    message:
        "tilt test: fit, inverse and confirmation"
    script:
        "../scripts/task.py"


checkpoint plan_drop:
    input:
        needs=refusing(lambda: swept_test(SETTINGS, "drop")),
        factors=FACTORS,
    output:
        **planned("drop"),
    params:
        function="calibration.chain.bench_tests.sweep:plan_drop",
        reads=[*PLANNING, *TESTS],
    message:
        "plan the drop test: sweep"
    script:
        "../scripts/task.py"


checkpoint plan_drop_confirmation:
    input:
        sweep=f"{STUDY}/drop/design.csv",
        runs=runs_of("drop"),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        **planned("drop_confirmation"),
    params:
        function="calibration.chain.bench_tests.sweep:plan_drop_confirmation",
        reads=[*PLANNING, *TESTS, "measurements"],
    message:
        "plan the drop test: runs at the inverse of the fit"
    script:
        "../scripts/task.py"


rule drop:
    input:
        sweep=f"{STUDY}/drop/design.csv",
        confirmation=f"{STUDY}/drop_confirmation/design.csv",
        runs=runs_of("drop_confirmation"),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        summary=f"{STUDY}/drop/drop.json",
        runs=f"{STUDY}/drop/runs.csv",
        figure=page("drop/drop.svg", "7 Bench tests"),
    params:
        function="calibration.chain.bench_tests.sweep:drop",
        reads=[*PLANNING, *TESTS, "measurements"],
    message:
        "drop test: fit, inverse and confirmation"
    script:
        "../scripts/task.py"


checkpoint plan_shear:
    input:
        needs=refusing(lambda: swept_test(SETTINGS, "shear")),
        factors=FACTORS,
    output:
        **planned("shear"),
    params:
        function="calibration.chain.bench_tests.shear:plan_shear",
        reads=[*PLANNING, *TESTS],
    message:
        "plan the shear test"
    script:
        "../scripts/task.py"


rule shear:
    input:
        design=f"{STUDY}/shear/design.csv",
        runs=runs_of("shear"),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        summary=f"{STUDY}/shear/shear.json",
        runs=f"{STUDY}/shear/runs.csv",
        figure=page("shear/yield_locus.svg", "7 Bench tests", "shear_yield_locus"),
    params:
        function="calibration.chain.bench_tests.shear:shear",
        reads=["factors", "fixed", *TESTS, "measurements"],
    message:
        "shear test: yield locus"
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
        function="calibration.chain.bench_tests.sweep:bench_parameters",
        reads=[],
    message:
        "collect what the bench tests found"
    script:
        "../scripts/task.py"
