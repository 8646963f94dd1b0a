rule optimise:
    input:
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        target=SETTINGS.target.file,
    output:
        summary=f"{STUDY}/optimise/optimum.json",
        solutions=f"{STUDY}/optimise/solution_set.csv",
        contours=report(
            f"{STUDY}/optimise/contours.svg",
            caption="../report/contours.rst",
            category="4 Optimum",
        ),
    log:
        f"{STUDY}/logs/optimise.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "optimum: all points that give the measured value, and the chosen one"
    script:
        "../scripts/optimise.py"
