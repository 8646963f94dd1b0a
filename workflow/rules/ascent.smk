# the region to look at closely: runs along the path of steepest ascent


checkpoint plan_ascent:
    input:
        screening=f"{STUDY}/screening/screening.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
        again=again("plan_ascent"),
    output:
        design=f"{STUDY}/ascent/design.csv",
        plan=f"{STUDY}/ascent/plan.json",
    log:
        f"{STUDY}/logs/plan_ascent.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.ascent:plan_ascent",
        reads=["seed", "experiment", "fixed", "run", "factors", "ascent"],
        seeds=1,
        made_from=made_from("plan_ascent"),
    message:
        "plan the steepest ascent"
    script:
        "../scripts/task.py"


rule ascent:
    input:
        design=f"{STUDY}/ascent/design.csv",
        runs=runs_of("ascent"),
        factors=FACTORS,
        measurements=measured,
        again=again("ascent"),
    output:
        runs=f"{STUDY}/ascent/runs.csv",
        summary=f"{STUDY}/ascent/ascent.json",
        path=report(
            f"{STUDY}/ascent/path.svg",
            caption="../report/ascent_path.rst",
            category="2 Steepest ascent",
        ),
    log:
        f"{STUDY}/logs/ascent.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.ascent:ascent",
        reads=[
            "factors",
            "response_surface",
            "target",
            "further_targets",
            "measurements",
            "experiment",
            "run",
        ],
        made_from=made_from("ascent"),
    message:
        "steepest ascent: the region's centre"
    script:
        "../scripts/task.py"
