# what the calibrated model gets wrong, its cause, and the gain: runs train emulators of the
# metrics, two waves of runs refine them near the posterior mode, one rule names the cause and plans
# the runs that measure the gain, and the last one gives the verdict

from diagnosis.declared import trained
from diagnosis.measurements import read_measurements

DIAGNOSIS_SETTINGS = user_file(SETTINGS.diagnosis.get("settings"))

# fixed, bench and push_through give levels and rigs that the settings do not
DIAGNOSIS_READS = [
    "experiment",
    "run",
    "factors",
    "diagnosis",
    "measurements",
    "fixed",
    "bench",
    "push_through",
]


def diagnosed(wildcards):
    """The table of measurements, as an input; refuses one that no diagnosis can be made of."""
    try:
        read_measurements(SETTINGS.measurements)
    except REFUSALS as error:
        raise WorkflowError(in_words(error))
    return MEASUREMENTS


checkpoint diagnosis_plan:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=diagnosed,
        again=again("diagnosis_plan"),
    output:
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        written=f"{STUDY}/diagnosis/settings.yaml",
    log:
        f"{STUDY}/logs/diagnosis_plan.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="diagnosis.stages:diagnosis_plan",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_plan"),
    message:
        "diagnosis: plan the runs that train the emulators"
    script:
        "../scripts/task.py"


rule diagnosis_emulate:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        runs=runs_of("diagnosis"),
        again=again("diagnosis_emulate"),
    output:
        emulators=f"{STUDY}/diagnosis/emulators.npz",
        errors=f"{STUDY}/diagnosis/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_emulate.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_emulate.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_emulate",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_emulate"),
    message:
        "diagnosis: train the emulators"
    script:
        "../scripts/task.py"


checkpoint diagnosis_wave_1:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=f"{STUDY}/diagnosis/emulators.npz",
        again=again("diagnosis_wave_1"),
    output:
        design=f"{STUDY}/diagnosis/wave_1/design.json",
        plan=f"{STUDY}/diagnosis/wave_1/plan.json",
        left=f"{STUDY}/diagnosis/wave_1/left.json",
    log:
        f"{STUDY}/logs/diagnosis_wave_1.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_wave_1.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_wave_1",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_wave_1"),
    message:
        "diagnosis: plan wave 1 of the emulators' runs, near the posterior mode"
    script:
        "../scripts/task.py"


rule diagnosis_refine_1:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=f"{STUDY}/diagnosis/emulators.npz",
        errors=f"{STUDY}/diagnosis/emulators.json",
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        design_1=f"{STUDY}/diagnosis/wave_1/design.json",
        plan_1=f"{STUDY}/diagnosis/wave_1/plan.json",
        runs=runs_of("diagnosis/wave_1"),
        again=again("diagnosis_refine_1"),
    output:
        refined_emulators=f"{STUDY}/diagnosis/wave_1/emulators.npz",
        refined_errors=f"{STUDY}/diagnosis/wave_1/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_refine_1.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_refine_1.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_refine_1",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_refine_1"),
    message:
        "diagnosis: train the emulators anew with wave 1"
    script:
        "../scripts/task.py"


checkpoint diagnosis_wave_2:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=f"{STUDY}/diagnosis/wave_1/emulators.npz",
        again=again("diagnosis_wave_2"),
    output:
        design=f"{STUDY}/diagnosis/wave_2/design.json",
        plan=f"{STUDY}/diagnosis/wave_2/plan.json",
        left=f"{STUDY}/diagnosis/wave_2/left.json",
    log:
        f"{STUDY}/logs/diagnosis_wave_2.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_wave_2.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_wave_2",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_wave_2"),
    message:
        "diagnosis: plan wave 2 of the emulators' runs, near the posterior mode"
    script:
        "../scripts/task.py"


rule diagnosis_refine_2:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=f"{STUDY}/diagnosis/wave_1/emulators.npz",
        errors=f"{STUDY}/diagnosis/wave_1/emulators.json",
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        design_1=f"{STUDY}/diagnosis/wave_1/design.json",
        plan_1=f"{STUDY}/diagnosis/wave_1/plan.json",
        design_2=f"{STUDY}/diagnosis/wave_2/design.json",
        plan_2=f"{STUDY}/diagnosis/wave_2/plan.json",
        runs=runs_of("diagnosis/wave_2"),
        again=again("diagnosis_refine_2"),
    output:
        refined_emulators=f"{STUDY}/diagnosis/wave_2/emulators.npz",
        refined_errors=f"{STUDY}/diagnosis/wave_2/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_refine_2.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_refine_2.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_refine_2",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_refine_2"),
    message:
        "diagnosis: train the emulators anew with wave 2"
    script:
        "../scripts/task.py"


rule diagnosis_calibrate:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=diagnosed,
        emulators=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/wave_2/emulators.npz"),
        again=again("diagnosis_calibrate"),
    output:
        summary=f"{STUDY}/diagnosis/calibration.json",
        table=f"{STUDY}/diagnosis/residuals.csv",
        residuals=report(
            f"{STUDY}/diagnosis/residuals.svg",
            caption="../report/diagnosis_residuals.rst",
            category="6 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnosis_calibrate.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_calibrate.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_calibrate",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_calibrate"),
    message:
        "diagnosis: calibrate the base model and show where it fails"
    script:
        "../scripts/task.py"


checkpoint diagnosis_identify:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/wave_2/emulators.npz"),
        errors=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/wave_2/emulators.json"),
        left_1=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/wave_1/left.json"),
        left_2=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/wave_2/left.json"),
        again=again("diagnosis_identify"),
    output:
        plan=f"{STUDY}/diagnosis/extension/plan.json",
        findings=f"{STUDY}/diagnosis/findings.json",
        extension=f"{STUDY}/diagnosis/extension.json",
        predictions=report(
            f"{STUDY}/diagnosis/predictions.svg",
            caption="../report/diagnosis_predictions.rst",
            category="6 Diagnosis",
        ),
        ranking=report(
            f"{STUDY}/diagnosis/ranking.svg",
            caption="../report/diagnosis_ranking.rst",
            category="6 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnosis_identify.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_identify.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_identify",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_identify"),
    message:
        "diagnosis: name the cause"
    script:
        "../scripts/task.py"


rule diagnose:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        calibration=f"{STUDY}/diagnosis/calibration.json",
        findings=f"{STUDY}/diagnosis/findings.json",
        extension=f"{STUDY}/diagnosis/extension.json",
        plan=f"{STUDY}/diagnosis/extension/plan.json",
        runs=runs_of("diagnosis/extension"),
        again=again("diagnose"),
    output:
        verdict=f"{STUDY}/diagnosis/verdict.json",
        page=report(
            f"{STUDY}/diagnosis/diagnosis.md",
            caption="../report/diagnosis.rst",
            category="6 Diagnosis",
        ),
        alone=f"{STUDY}/diagnosis/diagnosis.html",
        gain=report(
            f"{STUDY}/diagnosis/gain.svg",
            caption="../report/diagnosis_gain.rst",
            category="6 Diagnosis",
        ),
    log:
        f"{STUDY}/logs/diagnose.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="diagnosis.stages:diagnose",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnose"),
    message:
        "diagnosis: the gain of the extended model, and the verdict"
    script:
        "../scripts/task.py"


# before anything is measured: what a plan of measurements would show
rule diagnosis_power:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=lambda w: trained(SETTINGS, f"{STUDY}/diagnosis/emulators.npz"),
        again=again("diagnosis_power"),
    output:
        power=f"{STUDY}/diagnosis/power.json",
        page=f"{STUDY}/diagnosis/power.md",
    log:
        f"{STUDY}/logs/diagnosis_power.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_power.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.stages:diagnosis_power",
        reads=DIAGNOSIS_READS,
        made_from=made_from("diagnosis_power"),
    message:
        "diagnosis: how strong a law must be for this plan to show it"
    script:
        "../scripts/task.py"
