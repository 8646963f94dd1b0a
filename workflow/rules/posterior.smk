rule posterior:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        designs=[
            f"{STUDY}/{stage}/design.csv"
            for stage in ("ascent", "response_surface", "candidate", "validation")
        ],
        validation=f"{STUDY}/validation/validation.json",
        target=TARGETS,
    output:
        summary=f"{STUDY}/posterior/posterior.json",
        draws=f"{STUDY}/posterior/draws.csv",
    log:
        f"{STUDY}/logs/posterior.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "posterior: the parameters as a distribution"
    script:
        "../scripts/posterior.py"
