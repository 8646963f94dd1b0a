checkpoint plan_tilt:
    input:
        factors=SETTINGS.factors,
    output:
        design=f"{STUDY}/tilt/design.csv",
        plan=f"{STUDY}/tilt/plan.json",
    log:
        f"{STUDY}/logs/plan_tilt.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "plan the tilt test: sweep"
    script:
        "../scripts/plan_tilt.py"


checkpoint plan_tilt_confirmation:
    input:
        design=f"{STUDY}/tilt/design.csv",
        factors=SETTINGS.factors,
        runs=lambda w: results_of(checkpoints.plan_tilt.get().output.plan),
    output:
        design=f"{STUDY}/tilt_confirmation/design.csv",
        plan=f"{STUDY}/tilt_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_tilt_confirmation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "plan the tilt test: runs at the inverse of the fit"
    script:
        "../scripts/plan_tilt_confirmation.py"


rule tilt:
    input:
        sweep=f"{STUDY}/tilt/design.csv",
        confirmation=f"{STUDY}/tilt_confirmation/design.csv",
        runs=lambda w: results_of(checkpoints.plan_tilt_confirmation.get().output.plan),
    output:
        runs=f"{STUDY}/tilt/runs.csv",
        summary=f"{STUDY}/tilt/tilt.json",
        figure=report(
            f"{STUDY}/tilt/tilt.svg",
            caption="../report/tilt.rst",
            category="7 Bench tests",
        ),
    log:
        f"{STUDY}/logs/tilt.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "tilt test: fit, inverse and confirmation"
    script:
        "../scripts/tilt.py"


checkpoint plan_drop:
    input:
        factors=SETTINGS.factors,
    output:
        design=f"{STUDY}/drop/design.csv",
        plan=f"{STUDY}/drop/plan.json",
    log:
        f"{STUDY}/logs/plan_drop.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "plan the drop test: sweep"
    script:
        "../scripts/plan_drop.py"


checkpoint plan_drop_confirmation:
    input:
        design=f"{STUDY}/drop/design.csv",
        factors=SETTINGS.factors,
        runs=lambda w: results_of(checkpoints.plan_drop.get().output.plan),
    output:
        design=f"{STUDY}/drop_confirmation/design.csv",
        plan=f"{STUDY}/drop_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_drop_confirmation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "plan the drop test: runs at the inverse of the fit"
    script:
        "../scripts/plan_drop_confirmation.py"


rule drop:
    input:
        sweep=f"{STUDY}/drop/design.csv",
        confirmation=f"{STUDY}/drop_confirmation/design.csv",
        runs=lambda w: results_of(checkpoints.plan_drop_confirmation.get().output.plan),
    output:
        runs=f"{STUDY}/drop/runs.csv",
        summary=f"{STUDY}/drop/drop.json",
        figure=report(
            f"{STUDY}/drop/drop.svg",
            caption="../report/drop.rst",
            category="7 Bench tests",
        ),
    log:
        f"{STUDY}/logs/drop.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "drop test: fit, inverse and confirmation"
    script:
        "../scripts/drop.py"


checkpoint plan_shear:
    input:
        factors=SETTINGS.factors,
    output:
        design=f"{STUDY}/shear/design.csv",
        plan=f"{STUDY}/shear/plan.json",
    log:
        f"{STUDY}/logs/plan_shear.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "plan the shear test"
    script:
        "../scripts/plan_shear.py"


rule shear:
    input:
        design=f"{STUDY}/shear/design.csv",
        runs=lambda w: results_of(checkpoints.plan_shear.get().output.plan),
    output:
        runs=f"{STUDY}/shear/runs.csv",
        summary=f"{STUDY}/shear/shear.json",
        figure=report(
            f"{STUDY}/shear/yield_locus.svg",
            caption="../report/shear.rst",
            category="7 Bench tests",
        ),
    log:
        f"{STUDY}/logs/shear.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS.model_dump(mode="json"),
    message:
        "shear test: yield locus"
    script:
        "../scripts/shear.py"


# what the bench tests found, in the form of the configuration's `fixed`; the heaps take it with `fixed_from: bench`
rule bench_parameters:
    input:
        tilt=f"{STUDY}/tilt/tilt.json",
        drop=f"{STUDY}/drop/drop.json",
        shear=f"{STUDY}/shear/shear.json",
    output:
        f"{STUDY}/bench/fixed.json",
    log:
        f"{STUDY}/logs/bench_parameters.log",
    conda:
        "../envs/calibration.yaml"
    message:
        "collect what the bench tests found"
    script:
        "../scripts/bench_parameters.py"
