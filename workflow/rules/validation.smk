# replicates at the optimum against the measurement.
# `snakemake -j2 --forcerun validation -- validation` makes this analysis anew and nothing else;
# `--forcerun plan_validation -- validation` makes its plan anew too. A run that is there stays: it
# is made anew when its folder in results/runs is deleted


checkpoint plan_validation:
    input:
        **HANDED_OUT,
        factors=FACTORS,
        fixed=BENCH_VALUES,
    output:
        **planned("validation"),
    params:
        function="calibration.stages.validation:plan_validation",
        reads=[*PLANNING, "validation"],
        seeds=4,
    message:
        "plan the validation: replicates at the optimum"
    script:
        "../scripts/task.py"


rule validation:
    input:
        design=f"{STUDY}/validation/design.csv",
        runs=runs_of("validation"),
        measurements=measured,
    output:
        summary=f"{STUDY}/validation/validation.json",
        runs=f"{STUDY}/validation/runs.csv",
        figure=page("validation/validation.svg", "5 Validation"),
    params:
        function="calibration.stages.validation:validation",
        reads=[*RESPONSES, "validation"],
    message:
        "validation: replicates at the optimum against the measurement"
    script:
        "../scripts/task.py"
