rule candidate:
    input:
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        target=TARGETS,
    output:
        summary=f"{STUDY}/candidate/optimum.json",
        solutions=f"{STUDY}/candidate/solution_set.csv",
        contours=f"{STUDY}/candidate/contours.svg",
    log:
        f"{STUDY}/logs/candidate.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "candidate: the optimum of the response surface alone"
    script:
        "../scripts/candidate.py"


checkpoint plan_candidate:
    input:
        optimum=f"{STUDY}/candidate/optimum.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/candidate/design.csv",
        plan=f"{STUDY}/candidate/plan.json",
    log:
        f"{STUDY}/logs/plan_candidate.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the runs at the candidate"
    script:
        "../scripts/plan_candidate.py"


# the surface's optimum is one point of a fit to few runs: runs are added there and the surface is solved again, so that what is
# validated does not rest on how five centre runs happened to fall
rule optimise:
    input:
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        candidate=f"{STUDY}/candidate/design.csv",
        candidate_runs=lambda w: results_of(
            checkpoints.plan_candidate.get().output.plan
        ),
        target=TARGETS,
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
        settings=SETTINGS_DIGEST,
    message:
        "optimum: all points that give the measured value, and the chosen one"
    script:
        "../scripts/optimise.py"
