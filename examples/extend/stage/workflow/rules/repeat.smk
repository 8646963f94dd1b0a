checkpoint plan_repeat:
    input:
        factors=FACTORS,
        again=again("plan_repeat"),
    output:
        design=f"{STUDY}/repeat/design.csv",
        plan=f"{STUDY}/repeat/plan.json",
    log:
        f"{STUDY}/logs/plan_repeat.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.repeat:plan_repeat",
        reads=["seed", "experiment", "fixed", "run", "factors"],
        seeds=9,
        made_from=made_from("plan_repeat"),
    message:
        "plan the middle with several seeds"
    script:
        "../scripts/task.py"


rule repeat:
    input:
        design=f"{STUDY}/repeat/design.csv",
        runs=runs_of("repeat"),
        again=again("repeat"),
    output:
        summary=f"{STUDY}/repeat/repeat.json",
        table=f"{STUDY}/repeat/runs.csv",
        figure=f"{STUDY}/repeat/spread_of_seeds.svg",
    log:
        f"{STUDY}/logs/repeat.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.repeat:repeat",
        reads=["target"],
        made_from=made_from("repeat"),
    message:
        "how far runs of one point lie apart"
    script:
        "../scripts/task.py"
