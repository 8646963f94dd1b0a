# the stages as `src/calibration/study/stages` and its like declare them: a checkpoint for each task
# that plans runs, a rule for any other
for stage in STAGES.values():
    for task in stage.tasks:
        if task.plans:

            checkpoint:
                name:
                    task.rule
                input:
                    **inputs_of(task),
                output:
                    **outputs_of(stage, task),
                log:
                    f"{STUDY}/logs/{task.log}.log",
                localrule: task.cheap
                conda:
                    "../envs/calibration.yaml"
                params:
                    **params_of(task),
                message:
                    task.message
                script:
                    "../scripts/task.py"

        else:

            rule:
                name:
                    task.rule
                input:
                    **inputs_of(task),
                output:
                    **outputs_of(stage, task),
                log:
                    f"{STUDY}/logs/{task.log}.log",
                localrule: task.cheap
                conda:
                    "../envs/calibration.yaml"
                params:
                    **params_of(task),
                message:
                    task.message
                script:
                    "../scripts/task.py"
