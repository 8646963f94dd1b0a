rule bench_batch:
    input:
        plan=f"{STUDY}/{{stage}}/plan.json",
        compiled=ancient(COMPILED),
    output:
        done=f"{STUDY}/{{stage}}/batches/{{batch}}.json",
    log:
        f"{STUDY}/logs/{{stage}}_batch_{{batch}}.log",
    wildcard_constraints:
        stage="|".join(BATCHES_OF),
    conda:
        "../envs/calibration.yaml"
    params:
        batches=lambda wildcards: BATCHES_OF[wildcards.stage],
        failures="refused",
    message:
        "{wildcards.stage}: runs, batch {wildcards.batch}"
    script:
        "../scripts/batch.py"


rule plan_tilt:
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
        settings=SETTINGS_DIGEST,
    message:
        "plan the tilt test: sweep"
    script:
        "../scripts/plan_tilt.py"


rule plan_tilt_confirmation:
    input:
        design=f"{STUDY}/tilt/design.csv",
        factors=SETTINGS.factors,
        runs=batches_of("tilt"),
    output:
        design=f"{STUDY}/tilt_confirmation/design.csv",
        plan=f"{STUDY}/tilt_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_tilt_confirmation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the tilt test: runs at the inverse of the fit"
    script:
        "../scripts/plan_tilt_confirmation.py"


rule tilt:
    input:
        sweep=f"{STUDY}/tilt/design.csv",
        confirmation=f"{STUDY}/tilt_confirmation/design.csv",
        runs=batches_of("tilt_confirmation"),
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
        settings=SETTINGS_DIGEST,
    message:
        "tilt test: fit, inverse and confirmation"
    script:
        "../scripts/tilt.py"


rule plan_drop:
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
        settings=SETTINGS_DIGEST,
    message:
        "plan the drop test: sweep"
    script:
        "../scripts/plan_drop.py"


rule plan_drop_confirmation:
    input:
        design=f"{STUDY}/drop/design.csv",
        factors=SETTINGS.factors,
        runs=batches_of("drop"),
    output:
        design=f"{STUDY}/drop_confirmation/design.csv",
        plan=f"{STUDY}/drop_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_drop_confirmation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the drop test: runs at the inverse of the fit"
    script:
        "../scripts/plan_drop_confirmation.py"


rule drop:
    input:
        sweep=f"{STUDY}/drop/design.csv",
        confirmation=f"{STUDY}/drop_confirmation/design.csv",
        runs=batches_of("drop_confirmation"),
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
        settings=SETTINGS_DIGEST,
    message:
        "drop test: fit, inverse and confirmation"
    script:
        "../scripts/drop.py"


rule plan_shear:
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
        settings=SETTINGS_DIGEST,
    message:
        "plan the shear test"
    script:
        "../scripts/plan_shear.py"


rule shear:
    input:
        design=f"{STUDY}/shear/design.csv",
        runs=batches_of("shear"),
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
        settings=SETTINGS_DIGEST,
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
