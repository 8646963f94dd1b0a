# heap and drop with enlarged particles, by two rules, without and with cohesion


checkpoint plan_scaling:
    input:
        needs=needs("scaling", "plan_scaling"),
        factors=FACTORS,
    output:
        **planned("scaling"),
    params:
        function="calibration.stages.scaling:plan_scaling",
        reads=[*PLANNING, "run", "scaling"],
    message:
        "plan the scaling test: heap and drop, enlarged by two rules"
    script:
        "../scripts/task.py"


rule scaling:
    input:
        design=f"{STUDY}/scaling/design.csv",
        runs=runs_of("scaling"),
    output:
        summary=f"{STUDY}/scaling/scaling.json",
        runs=f"{STUDY}/scaling/runs.csv",
        table=f"{STUDY}/scaling/scaling.csv",
        figure=page("scaling/scaling.svg", "7 Bench tests"),
    params:
        function="calibration.stages.scaling:scaling",
        reads=["run", "scaling"],
    message:
        "scaling test: angle and rebound against scale, and what is said of them"
    script:
        "../scripts/task.py"
