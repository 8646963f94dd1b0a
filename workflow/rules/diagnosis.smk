# what the calibrated model gets wrong, its cause, and the gain: runs train emulators of the
# metrics, two waves of runs refine them near the posterior mode, one rule names the cause and plans
# the runs that measure the gain, and the last one gives the verdict

from diagnosis.declared import WAVES, other_settings, trained
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


EACH_WAVE = [f"{STUDY}/diagnosis/wave_{k}" for k in range(1, WAVES + 1)]


checkpoint diagnosis_plan:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=diagnosed,
    output:
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        written=f"{STUDY}/diagnosis/settings.yaml",
    log:
        f"{STUDY}/logs/diagnosis_plan.log",
    params:
        function="diagnosis.stages:diagnosis_plan",
        reads=DIAGNOSIS_READS,
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
    output:
        emulators=f"{STUDY}/diagnosis/emulators.npz",
        errors=f"{STUDY}/diagnosis/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_emulate.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_emulate.tsv"
    params:
        function="diagnosis.stages:diagnosis_emulate",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: train the emulators"
    script:
        "../scripts/task.py"


checkpoint diagnosis_wave:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=lambda w: wave_before(w, "emulators.npz"),
    output:
        design=f"{STUDY}/diagnosis/wave_{{wave}}/design.json",
        plan=f"{STUDY}/diagnosis/wave_{{wave}}/plan.json",
        left=f"{STUDY}/diagnosis/wave_{{wave}}/left.json",
    log:
        f"{STUDY}/logs/diagnosis_wave_{{wave}}.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_wave_{{wave}}.tsv"
    params:
        function="diagnosis.stages:diagnosis_wave",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: plan wave {wildcards.wave} of the emulators' runs, near the posterior mode"
    script:
        "../scripts/task.py"


rule diagnosis_refine:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=lambda w: wave_before(w, "emulators.npz"),
        errors=lambda w: wave_before(w, "emulators.json"),
        designs=lambda w: waves_until(w, "design.json"),
        plans=lambda w: waves_until(w, "plan.json"),
        runs=lambda w: runs_of(f"diagnosis/wave_{w.wave}")(w),
    output:
        refined_emulators=f"{STUDY}/diagnosis/wave_{{wave}}/emulators.npz",
        refined_errors=f"{STUDY}/diagnosis/wave_{{wave}}/emulators.json",
    log:
        f"{STUDY}/logs/diagnosis_refine_{{wave}}.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_refine_{{wave}}.tsv"
    params:
        function="diagnosis.stages:diagnosis_refine",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: train the emulators anew with wave {wildcards.wave}"
    script:
        "../scripts/task.py"


rule diagnosis_calibrate:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=diagnosed,
        emulators=lambda w: trained(SETTINGS, f"{EACH_WAVE[-1]}/emulators.npz"),
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
    params:
        function="diagnosis.stages:diagnosis_calibrate",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: calibrate the base model and show where it fails"
    script:
        "../scripts/task.py"


checkpoint diagnosis_identify:
    input:
        settings=DIAGNOSIS_SETTINGS,
        factors=FACTORS,
        measurements=MEASUREMENTS,
        emulators=lambda w: trained(SETTINGS, f"{EACH_WAVE[-1]}/emulators.npz"),
        errors=lambda w: trained(SETTINGS, f"{EACH_WAVE[-1]}/emulators.json"),
        left=lambda w: trained(SETTINGS, [f"{wave}/left.json" for wave in EACH_WAVE]),
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
    params:
        function="diagnosis.stages:diagnosis_identify",
        reads=DIAGNOSIS_READS,
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
    params:
        function="diagnosis.stages:diagnose",
        reads=DIAGNOSIS_READS,
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
    output:
        power=f"{STUDY}/diagnosis/power.json",
        page=f"{STUDY}/diagnosis/power.md",
    log:
        f"{STUDY}/logs/diagnosis_power.log",
    benchmark:
        f"{STUDY}/logs/diagnosis_power.tsv"
    params:
        function="diagnosis.stages:diagnosis_power",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: how strong a law must be for this plan to show it"
    script:
        "../scripts/task.py"
