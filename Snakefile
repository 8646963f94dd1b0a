# The paper's study: the workflow, and what concerns the paper alone. A study that names none of it
# in `supplements` sees nothing of it.
SUPPLEMENTS = ["paper.stages"]


include: "workflow/Snakefile"


if "paper.stages" in DECLARED:

    include: "workflow/paper.smk"


# the default target of an included file does not count
rule study:
    default_target: True
    input:
        rules.all.input,


# what takes longer than the study and is no part of it: the study with more runs and what the paper
# claims beyond its calibration, with the posterior in another machine; the study in the rig as
# printed and out of a funnel that is filled and then opened; and the ways to calibrate compared.
# Each study is a call of its own, with this one's configuration below its files; runs that
# exist are not repeated. The first bears this one's name, and its results take the place of these
rule reference:
    input:
        compared=f"{RESULTS}/comparison/summary.csv",
    log:
        f"{RESULTS}/comparison/reference.log",
    threads: workflow.resource_settings.cores or 1
    params:
        configuration=CONFIG_FILES,
        studies=[
            ["config/reference.yaml", "--", "study", "push_through"],
            ["config/reference.yaml", "config/rigs/printed.yaml"],
            ["config/reference.yaml", "config/rigs/opened.yaml"],
        ],
    message:
        "reference: more runs, further claims, two other rigs"
    script:
        "workflow/scripts/reference.py"


rule comparison:
    output:
        compared=f"{RESULTS}/comparison/summary.csv",
    log:
        f"{RESULTS}/comparison/comparison.log",
    threads: workflow.resource_settings.cores or 1
    params:
        python=sys.executable,
    message:
        "comparison: the ways to calibrate, tried on responses in closed form"
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 {params.python} -m benchmarks.ways"
        " $(dirname {output.compared}) --processes={threads} > {log} 2>&1"
