# the region to look at closely: runs along the path of steepest ascent


checkpoint plan_ascent:
    input:
        screening=f"{STUDY}/screening/screening.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("ascent"),
    params:
        function="calibration.stages.ascent:plan_ascent",
        reads=[*PLANNING, "ascent"],
        seeds=1,
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
    output:
        runs=f"{STUDY}/ascent/runs.csv",
        summary=f"{STUDY}/ascent/ascent.json",
        path=page("ascent/path.svg", "2 Steepest ascent", "ascent_path"),
    params:
        function="calibration.stages.ascent:ascent",
        reads=[*RESPONSES, "factors", "response_surface"],
    message:
        "steepest ascent: the region's centre"
    script:
        "../scripts/task.py"
