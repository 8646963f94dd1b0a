# direct shear as a virtual experiment: yield loci over the particle friction


checkpoint plan_shear:
    input:
        needs=refusing(lambda: swept_test(SETTINGS, "shear")),
        factors=FACTORS,
    output:
        **planned("shear"),
    params:
        function="calibration.stages.bench_tests:plan_shear",
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
        function="calibration.stages.bench_tests:shear",
        reads=["factors", "fixed", *TESTS, "measurements"],
    message:
        "shear test: yield locus"
    script:
        "../scripts/task.py"
