# a quadratic model of the region: the runs of a Box-Behnken design around the ascent's end.
# `plan_response_surface` makes the design from the ascent's result and the factors: design.csv has
# its points, plan.json the spec of each run. `dem_run` in runs.smk makes the runs, one each, or
# `run_batch` where several share a process. `response_surface` waits for them: `runs_of`


checkpoint plan_response_surface:
    input:
        ascent=f"{STUDY}/ascent/ascent.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("response_surface"),
        region=f"{STUDY}/response_surface/region.json",
    params:
        function="calibration.stages.response_surface:plan_response_surface",
        reads=[*PLANNING, "response_surface"],
        seeds=2,
    message:
        "plan the response surface: Box-Behnken design"
    script:
        "../scripts/task.py"


rule response_surface:
    input:
        design=f"{STUDY}/response_surface/design.csv",
        region=f"{STUDY}/response_surface/region.json",
        runs=runs_of("response_surface"),
        measurements=measured,
    output:
        runs=f"{STUDY}/response_surface/runs.csv",
        coefficients=f"{STUDY}/response_surface/coefficients.csv",
        anova=f"{STUDY}/response_surface/anova.csv",
        diagnostics=f"{STUDY}/response_surface/diagnostics.csv",
        summary=f"{STUDY}/response_surface/response_surface.json",
        surfaces=page("response_surface/surfaces.svg", "3 Response surface"),
        predicted=page("response_surface/predicted_actual.svg", "3 Response surface"),
        residuals=page("response_surface/residuals.svg", "3 Response surface"),
        perturbation=page("response_surface/perturbation.svg", "3 Response surface"),
    params:
        function="calibration.stages.response_surface:response_surface",
        reads=RESPONSES,
    message:
        "response surface: quadratic model and its ANOVA"
    script:
        "../scripts/task.py"
