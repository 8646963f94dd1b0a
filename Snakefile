# The paper's study: the workflow, and what concerns the paper alone. A study that names none of it
# in `supplements` sees nothing of it.
SUPPLEMENTS = ["paper.stages"]


include: "workflow/Snakefile"


# the default target of an included file does not count
rule study:
    default_target: True
    input:
        rules.all.input,
