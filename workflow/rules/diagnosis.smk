from diagnosis.settings import read_settings

DIAGNOSIS = f"{STUDY}/diagnosis"
DIAGNOSIS_SETTINGS = "config/diagnosis.yaml"
DIAGNOSIS_CODE = sorted(str(p) for p in Path("src/diagnosis").rglob("*.py"))

try:
    BATCHES = range(read_settings(DIAGNOSIS_SETTINGS, SETTINGS.diagnosis).batches)
except CalibrationError as error:
    raise WorkflowError(str(error))


rule diagnosis_plan:
    input:
        DIAGNOSIS_CODE,
        measurements=SETTINGS.measurements or [],
        settings=DIAGNOSIS_SETTINGS,
        factors=SETTINGS.factors,
    output:
        design=f"{DIAGNOSIS}/design.json",
        plan=f"{DIAGNOSIS}/plan.json",
    log:
        f"{STUDY}/logs/diagnosis_plan.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "diagnosis: plan the runs that teach the emulators"
    script:
        "../scripts/diagnosis_plan.py"


# many runs of a second each share a process; each is kept under its content, so a second diagnosis finds it
rule diagnosis_batch:
    input:
        plan=f"{DIAGNOSIS}/plan.json",
        compiled=ancient(COMPILED),
    output:
        done=f"{DIAGNOSIS}/batches/{{batch}}.json",
    log:
        f"{STUDY}/logs/diagnosis_batch_{{batch}}.log",
    conda:
        "../envs/calibration.yaml"
    params:
        batches=len(BATCHES),
        failures="kept",
    message:
        "diagnosis: emulator runs, batch {wildcards.batch}"
    script:
        "../scripts/batch.py"


rule diagnosis_emulate:
    input:
        DIAGNOSIS_CODE,
        measurements=SETTINGS.measurements or [],
        settings=DIAGNOSIS_SETTINGS,
        design=f"{DIAGNOSIS}/design.json",
        plan=f"{DIAGNOSIS}/plan.json",
        batches=expand(f"{DIAGNOSIS}/batches/{{batch}}.json", batch=BATCHES),
    output:
        emulators=f"{DIAGNOSIS}/emulators.npz",
        errors=f"{DIAGNOSIS}/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_emulate.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "diagnosis: teach the emulators"
    script:
        "../scripts/diagnosis_emulate.py"


rule diagnosis_calibrate:
    input:
        measurements=SETTINGS.measurements or [],
        settings=DIAGNOSIS_SETTINGS,
        emulators=f"{DIAGNOSIS}/emulators.npz",
    output:
        summary=f"{DIAGNOSIS}/calibration.json",
        table=f"{DIAGNOSIS}/residuals.csv",
        residuals=report(
            f"{DIAGNOSIS}/residuals.svg",
            caption="../report/diagnosis_residuals.rst",
            category="9 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnosis_calibrate.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "diagnosis: calibrate the base model and show where it fails"
    script:
        "../scripts/diagnosis_calibrate.py"


rule diagnosis_identify:
    input:
        measurements=SETTINGS.measurements or [],
        settings=DIAGNOSIS_SETTINGS,
        emulators=f"{DIAGNOSIS}/emulators.npz",
        errors=f"{DIAGNOSIS}/emulators.json",
    output:
        findings=f"{DIAGNOSIS}/findings.json",
        extension=f"{DIAGNOSIS}/extension.json",
        plan=f"{DIAGNOSIS}/extension_plan.json",
        predictions=report(
            f"{DIAGNOSIS}/predictions.svg",
            caption="../report/diagnosis_predictions.rst",
            category="9 Diagnosis",
        ),
        ranking=report(
            f"{DIAGNOSIS}/ranking.svg",
            caption="../report/diagnosis_ranking.rst",
            category="9 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnosis_identify.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "diagnosis: name the cause"
    script:
        "../scripts/diagnosis_identify.py"


use rule diagnosis_batch as diagnosis_extension_batch with:
    input:
        plan=f"{DIAGNOSIS}/extension_plan.json",
        compiled=ancient(COMPILED),
    output:
        done=f"{DIAGNOSIS}/extension/{{batch}}.json",
    log:
        f"{STUDY}/logs/diagnosis_extension_{{batch}}.log",
    message:
        "diagnosis: the extended model on all measurements, batch {wildcards.batch}"


rule diagnose:
    input:
        rules.diagnosis_calibrate.output,
        measurements=SETTINGS.measurements or [],
        settings=DIAGNOSIS_SETTINGS,
        findings=f"{DIAGNOSIS}/findings.json",
        extension=f"{DIAGNOSIS}/extension.json",
        plan=f"{DIAGNOSIS}/extension_plan.json",
        batches=expand(f"{DIAGNOSIS}/extension/{{batch}}.json", batch=BATCHES),
    output:
        verdict=f"{DIAGNOSIS}/verdict.json",
        page=report(
            f"{DIAGNOSIS}/diagnosis.md",
            caption="../report/diagnosis.rst",
            category="9 Diagnosis",
        ),
        gain=report(
            f"{DIAGNOSIS}/gain.svg",
            caption="../report/diagnosis_gain.rst",
            category="9 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnose.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "diagnosis: the gain of the extended model, and the verdict"
    script:
        "../scripts/diagnosis_conclude.py"


DISCOVERY = f"{STUDY}/discovery"
DISCOVERY_SETTINGS = "config/discovery.yaml"
SHARDS = range(8)

try:
    DISCOVERY_BATCHES = range(read_settings(DISCOVERY_SETTINGS).batches)
except CalibrationError as error:
    raise WorkflowError(str(error))


# the benchmark asks nothing of the measurements: its data are hidden effects in the real engine
rule discovery_plan:
    input:
        DIAGNOSIS_CODE,
        settings=DISCOVERY_SETTINGS,
        factors=SETTINGS.factors,
    output:
        design=f"{DISCOVERY}/design.json",
        plan=f"{DISCOVERY}/plan.json",
    log:
        f"{STUDY}/logs/discovery_plan.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "benchmark of the diagnosis: plan the emulators' runs"
    script:
        "../scripts/diagnosis_benchmark_plan.py"


use rule diagnosis_batch as discovery_batch with:
    input:
        plan=f"{DISCOVERY}/plan.json",
        compiled=ancient(COMPILED),
    output:
        done=f"{DISCOVERY}/batches/{{batch}}.json",
    log:
        f"{STUDY}/logs/discovery_batch_{{batch}}.log",
    params:
        batches=len(DISCOVERY_BATCHES),
        failures="kept",
    message:
        "benchmark of the diagnosis: emulator runs, batch {wildcards.batch}"


rule discovery_emulate:
    input:
        DIAGNOSIS_CODE,
        settings=DISCOVERY_SETTINGS,
        design=f"{DISCOVERY}/design.json",
        plan=f"{DISCOVERY}/plan.json",
        batches=expand(f"{DISCOVERY}/batches/{{batch}}.json", batch=DISCOVERY_BATCHES),
    output:
        emulators=f"{DISCOVERY}/emulators.npz",
        errors=f"{DISCOVERY}/emulators.json",
    log:
        f"{STUDY}/logs/discovery_emulate.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "benchmark of the diagnosis: teach the emulators"
    script:
        "../scripts/diagnosis_benchmark_emulate.py"


# each finished case is kept beside the table, so that an interrupted shard goes on where it was
rule discovery_shard:
    input:
        DIAGNOSIS_CODE,
        settings=DISCOVERY_SETTINGS,
        plan=f"{DISCOVERY}/plan.json",
        emulators=f"{DISCOVERY}/emulators.npz",
    output:
        table=f"{DISCOVERY}/cases/{{shard}}.csv",
    log:
        f"{STUDY}/logs/discovery_shard_{{shard}}.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
        shards=len(SHARDS),
        kept=f"{DISCOVERY}/kept",
    message:
        "benchmark of the diagnosis: cases, part {wildcards.shard}"
    script:
        "../scripts/diagnosis_benchmark_shard.py"


rule discovery_benchmark:
    input:
        expand(f"{DISCOVERY}/cases/{{shard}}.csv", shard=SHARDS),
    output:
        cases=f"{DISCOVERY}/cases.csv",
        confusion=f"{DISCOVERY}/confusion.csv",
        summary=f"{DISCOVERY}/summary.csv",
        page=f"{DISCOVERY}/rates.md",
        figure=f"{DISCOVERY}/benchmark.svg",
    log:
        f"{STUDY}/logs/discovery_benchmark.log",
    conda:
        "../envs/calibration.yaml"
    message:
        "benchmark of the diagnosis: confusion matrix, power, false alarms"
    script:
        "../scripts/diagnosis_benchmark_merge.py"
