# replicates at the optimum against the measurement.
# `snakemake -j2 --forcerun validation -- validation` makes this analysis anew and nothing else;
# `--forcerun plan_validation -- validation` makes its plan anew too. A run that is there stays: it
# is made anew when its folder in results/runs is deleted


checkpoint plan_validation:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=FACTORS,
        fixed=BENCH_VALUES,
        again=again("plan_validation"),
    output:
        design=f"{STUDY}/validation/design.csv",
        plan=f"{STUDY}/validation/plan.json",
    log:
        f"{STUDY}/logs/plan_validation.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.validation:plan_validation",
        reads=["seed", "experiment", "fixed", "run", "factors", "validation"],
        seeds=4,
        made_from=made_from("plan_validation"),
    message:
        "plan the validation: replicates at the optimum"
    script:
        "../scripts/task.py"


rule validation:
    input:
        design=f"{STUDY}/validation/design.csv",
        runs=runs_of("validation"),
        measurements=measured,
        again=again("validation"),
    output:
        summary=f"{STUDY}/validation/validation.json",
        runs=f"{STUDY}/validation/runs.csv",
        further_figures=each_further("validation/{}.svg", measured=True),
        figure=report(
            f"{STUDY}/validation/validation.svg",
            caption="../report/validation.rst",
            category="5 Validation",
        ),
    log:
        f"{STUDY}/logs/validation.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.chain.validation:validation",
        reads=[
            "validation",
            "target",
            "further_targets",
            "measurements",
            "experiment",
            "run",
        ],
        made_from=made_from("validation"),
    message:
        "validation: replicates at the optimum against the measurement"
    script:
        "../scripts/task.py"
