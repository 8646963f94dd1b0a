# the parameters as a distribution, from the runs of the chain and the measured values


rule posterior:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        designs=[
            f"{STUDY}/ascent/design.csv",
            f"{STUDY}/response_surface/design.csv",
            f"{STUDY}/candidate/design.csv",
            # of the joint posterior's parameters it is at other levels of what was held
            *([] if BY_JOINT else [f"{STUDY}/validation/design.csv"]),
        ],
        validation=f"{STUDY}/validation/validation.json",
        runs=runs_of("validation"),
        measurements=measured,
    output:
        summary=f"{STUDY}/posterior/posterior.json",
        draws=f"{STUDY}/posterior/draws.csv",
        parameters=f"{STUDY}/posterior/parameters.csv",
        targets=f"{STUDY}/posterior/targets.csv",
        next=f"{STUDY}/posterior/next.csv",
        predictions=f"{STUDY}/posterior/predictions.csv",
        pairs=page(
            "posterior/pairs.svg",
            "5 The parameters as a distribution",
            "posterior_pairs",
        ),
    benchmark:
        f"{STUDY}/logs/posterior.tsv"
    params:
        function="calibration.stages.joint:posterior",
        reads=[*RESPONSES, "seed", "posterior"],
    message:
        "posterior: the parameters as a distribution"
    script:
        "../scripts/task.py"
