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


# what takes longer than the study and is no part of it: what the paper claims beyond its
# calibration, the study in the rig as printed and out of
# a funnel that is filled and then opened, the pour rate, the posterior in another machine, and the
# ways to calibrate compared. Each is a study of its own, so each is a call of its own, with this
# one's configuration below its file; runs that exist are not repeated
rule reference:
    input:
        rules.all.input,
        pour_rate=f"{STUDY}/pour_rate/pour_rate.json",
        pushed=f"{STUDY}/push_through/push_through.json",
    output:
        compared=f"{RESULTS}/comparison/summary.csv",
    log:
        f"{RESULTS}/comparison/reference.log",
    threads: workflow.resource_settings.cores or 1
    params:
        configuration=CONFIG_FILES,
        studies=[
            ["config/claims.yaml"],
            ["config/claims.yaml", "config/rigs/printed.yaml"],
            ["config/rigs/opened.yaml"],
        ],
    message:
        "reference: further claims, two other rigs, the pour rate, the ways to calibrate compared"
    script:
        "workflow/scripts/reference.py"
