# one posterior over all tests of the laboratory: a common design for all rigs, runs added where the
# posterior is wide, the posterior itself


checkpoint plan_joint_first:
    input:
        **({"measurements": MEASUREMENTS} if SETTINGS.by_atlas else {}),
        measured=refusing(lambda: check_targets(SETTINGS)),
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("joint_first"),
    params:
        function="calibration.stages.joint:plan_joint_first",
        reads=[
            *PLANNING,
            *TESTS,
            "joint",
            "by_atlas",
            *(["measurements", "posterior"] if SETTINGS.by_atlas else []),
        ],
        seeds=7,
    message:
        "plan the first runs for all rigs of the laboratory"
    script:
        "../scripts/task.py"


# its design has the first runs too, its plan those that are added
checkpoint plan_joint:
    input:
        factors=FACTORS,
        fixed=BENCH_VALUES,
        measurements=MEASUREMENTS,
        first=f"{STUDY}/joint_first/design.csv",
        runs=runs_of("joint_first"),
    output:
        **planned("joint"),
    benchmark:
        f"{STUDY}/logs/plan_joint.tsv"
    params:
        function="calibration.stages.joint:plan_joint",
        reads=[*PLANNING, *TESTS, "joint", "by_atlas", "posterior", "measurements"],
        seeds=7,
    message:
        "plan runs where the joint posterior is wide"
    script:
        "../scripts/task.py"


rule joint:
    input:
        factors=FACTORS,
        measurements=MEASUREMENTS,
        design=f"{STUDY}/joint/design.csv",
        runs=runs_of("joint"),
        first_runs=runs_of("joint_first"),
    output:
        summary=f"{STUDY}/joint/joint.json",
        draws=f"{STUDY}/joint/draws.csv",
        parameters=f"{STUDY}/joint/parameters.csv",
        targets=f"{STUDY}/joint/targets.csv",
        next=f"{STUDY}/joint/next.csv",
        predictions=f"{STUDY}/joint/predictions.csv",
        pairs=page("joint/pairs.svg", "5 All tests together", "posterior_pairs"),
    benchmark:
        f"{STUDY}/logs/joint.tsv"
    params:
        function="calibration.stages.joint:joint",
        reads=[
            "seed",
            "experiment",
            "factors",
            "joint",
            "by_atlas",
            "posterior",
            *TESTS,
            "measurements",
        ],
    message:
        "joint: one posterior over all tests"
    script:
        "../scripts/task.py"
