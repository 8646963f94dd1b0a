checkpoint plan_repeat:
    input:
        factors=FACTORS,
    output:
        **planned("repeat"),
    params:
        function="calibration.stages.repeat:plan_repeat",
        reads=PLANNING,
        seeds=9,
    message:
        "plan the middle with several seeds"
    script:
        "../scripts/task.py"


rule repeat:
    input:
        design=f"{STUDY}/repeat/design.csv",
        runs=runs_of("repeat"),
    output:
        summary=f"{STUDY}/repeat/repeat.json",
        table=f"{STUDY}/repeat/runs.csv",
        figure=f"{STUDY}/repeat/spread_of_seeds.svg",
    params:
        function="calibration.stages.repeat:repeat",
        reads=["target"],
    message:
        "how far runs of one point lie apart"
    script:
        "../scripts/task.py"
