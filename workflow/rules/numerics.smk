# what resolution, time step, modulus and rolling law cost in the response


checkpoint plan_numerics:
    input:
        needs=needs("numerics", "plan_numerics"),
        variants=user_file(SETTINGS.numerics),
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/numerics/design.csv",
        plan=f"{STUDY}/numerics/plan.json",
    log:
        f"{STUDY}/logs/plan_numerics.log",
    params:
        function="calibration.chain.numerics:plan_numerics",
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
        figure=report(
            f"{STUDY}/numerics/numerics.svg",
            caption="../report/numerics.rst",
            category="11 Numerics",
        ),
    log:
        f"{STUDY}/logs/numerics.log",
    params:
        function="calibration.chain.numerics:numerics",
        reads=["target"],
    message:
        "numerics: what the numerical choices cost"
    script:
        "../scripts/task.py"
