# what resolution, time step, modulus and rolling law cost in the response


checkpoint plan_numerics:
    input:
        needs=needs("numerics", "plan_numerics"),
        variants=user_file(SETTINGS.numerics),
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("numerics"),
    params:
        function="calibration.stages.numerics:plan_numerics",
        reads=[*PLANNING, "numerics"],
    message:
        "plan the study of resolution, time step, modulus and rolling law"
    script:
        "../scripts/task.py"


rule numerics:
    input:
        design=f"{STUDY}/numerics/design.csv",
        runs=runs_of("numerics"),
    output:
        table=f"{STUDY}/numerics/numerics.csv",
        figure=page("numerics/numerics.svg", "11 Numerics"),
    params:
        function="calibration.stages.numerics:numerics",
        reads=["target"],
    message:
        "numerics: what the numerical choices cost"
    script:
        "../scripts/task.py"
