# the optimum: the surface's own (the candidate), runs there, and the surface solved again with
# them. How many runs it takes, the scatter of the first ones says


rule candidate:
    input:
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        measurements=measured,
    output:
        summary=f"{STUDY}/candidate/optimum.json",
        solutions=f"{STUDY}/candidate/solution_set.csv",
        contours=f"{STUDY}/candidate/contours.svg",
    params:
        function="calibration.stages.optimum:candidate",
        reads=[*RESPONSES, "seed", "optimise", "validation"],
    message:
        "candidate: the optimum of the response surface alone"
    script:
        "../scripts/task.py"


checkpoint plan_candidate_first:
    input:
        optimum=f"{STUDY}/candidate/optimum.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("candidate_first"),
    params:
        function="calibration.stages.optimum:plan_candidate_first",
        reads=[*PLANNING, "optimise", "response_surface"],
        seeds=3,
    message:
        "plan the first runs at the candidate"
    script:
        "../scripts/task.py"


# its design has the first runs too, its plan those that they ask for
checkpoint plan_candidate:
    input:
        optimum=f"{STUDY}/candidate/optimum.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
        first=f"{STUDY}/candidate_first/design.csv",
        runs=runs_of("candidate_first"),
    output:
        **planned("candidate"),
        region=f"{STUDY}/candidate/region.json",
    params:
        function="calibration.stages.optimum:plan_candidate",
        reads=[*PLANNING, "optimise", "response_surface", "target"],
        seeds=3,
    message:
        "plan as many more runs at the candidate as the scatter of the first asks for"
    script:
        "../scripts/task.py"


rule optimise:
    input:
        runs=f"{STUDY}/response_surface/runs.csv",
        candidate=f"{STUDY}/candidate/design.csv",
        candidate_region=f"{STUDY}/candidate/region.json",
        candidate_runs=runs_of("candidate"),
        measurements=measured,
    output:
        summary=f"{STUDY}/optimise/optimum.json",
        solutions=f"{STUDY}/optimise/solution_set.csv",
        contours=page("optimise/contours.svg", "4 Optimum"),
    params:
        function="calibration.stages.optimum:optimise",
        reads=[*RESPONSES, "seed", "optimise", "validation"],
    message:
        "optimum: all points that give the measured value, and the chosen one"
    script:
        "../scripts/task.py"
