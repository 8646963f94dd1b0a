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


# a sweep of one parameter, its fit, and runs at the inverse for the measured value: `tilt` and `drop`
for test in ("tilt", "drop"):

    rule:
        name:
            f"plan_{test}"
        input:
            factors=SETTINGS.factors,
        output:
            design=f"{STUDY}/{test}/design.csv",
            plan=f"{STUDY}/{test}/plan.json",
        log:
            f"{STUDY}/logs/plan_{test}.log",
        conda:
            "../envs/calibration.yaml"
        params:
            settings=SETTINGS_DIGEST,
            test=test,
        message:
            f"plan the {test} test: sweep"
        script:
            "../scripts/plan_sweep.py"

    rule:
        name:
            f"plan_{test}_confirmation"
        input:
            design=f"{STUDY}/{test}/design.csv",
            factors=SETTINGS.factors,
            runs=batches_of(test),
        output:
            design=f"{STUDY}/{test}_confirmation/design.csv",
            plan=f"{STUDY}/{test}_confirmation/plan.json",
        log:
            f"{STUDY}/logs/plan_{test}_confirmation.log",
        conda:
            "../envs/calibration.yaml"
        params:
            settings=SETTINGS_DIGEST,
            test=test,
        message:
            f"plan the {test} test: runs at the inverse of the fit"
        script:
            "../scripts/plan_sweep_confirmation.py"

    rule:
        name:
            test
        input:
            sweep=f"{STUDY}/{test}/design.csv",
            confirmation=f"{STUDY}/{test}_confirmation/design.csv",
            factors=SETTINGS.factors,
            runs=batches_of(f"{test}_confirmation"),
        output:
            runs=f"{STUDY}/{test}/runs.csv",
            summary=f"{STUDY}/{test}/{test}.json",
            figure=report(
                f"{STUDY}/{test}/{test}.svg",
                caption=f"../report/{test}.rst",
                category="7 Bench tests",
            ),
        log:
            f"{STUDY}/logs/{test}.log",
        conda:
            "../envs/calibration.yaml"
        params:
            settings=SETTINGS_DIGEST,
            test=test,
        message:
            f"{test} test: fit, inverse and confirmation"
        script:
            "../scripts/sweep.py"


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
