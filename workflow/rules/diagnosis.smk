# what the calibrated model gets wrong, its cause, and the gain: runs train emulators of the
# metrics, two waves of runs refine them near the posterior mode, one rule names the cause and plans
# the runs that measure the gain, and the last one gives the verdict

from diagnosis.declared import WAVES
from diagnosis.measurements import need_emulators, read_all

# tests and fixed levels give what the settings do not
DIAGNOSIS_READS = [*TESTS, "own_run", "experiment", "fixed", "factors", "diagnosis"]
DIAGNOSIS_READS += ["measurements"]
EACH_WAVE = [f"{STUDY}/diagnosis/wave_{k}" for k in range(1, WAVES + 1)]


checkpoint diagnosis_plan:
    input:
        factors=FACTORS,
        measurements=diagnosed,
    output:
        design=f"{STUDY}/diagnosis/design.json",
        plan=f"{STUDY}/diagnosis/plan.json",
        written=f"{STUDY}/diagnosis/settings.yaml",
    params:
        function="diagnosis.stages:diagnosis_plan",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: plan the runs that train the emulators"
    script:
        "../scripts/task.py"


checkpoint diagnosis_wave:
    input:
        unpack(lambda w: training(int(w.wave) - 1)),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        design=f"{STUDY}/diagnosis/wave_{{wave}}/design.json",
        plan=f"{STUDY}/diagnosis/wave_{{wave}}/plan.json",
        left=f"{STUDY}/diagnosis/wave_{{wave}}/left.json",
    benchmark:
        f"{STUDY}/logs/diagnosis_wave_{{wave}}.tsv"
    params:
        function="diagnosis.stages:diagnosis_wave",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: plan wave {wildcards.wave} of the emulators' runs, near the posterior mode"
    script:
        "../scripts/task.py"


checkpoint diagnosis_identify:
    input:
        unpack(lambda w: training(WAVES)),
        factors=FACTORS,
        measurements=diagnosed,
        left=lambda w: of_waves("left.json"),
    output:
        plan=f"{STUDY}/diagnosis/extension/plan.json",
        findings=f"{STUDY}/diagnosis/findings.json",
        extension=f"{STUDY}/diagnosis/extension.json",
        table=f"{STUDY}/diagnosis/residuals.csv",
        residuals=page("diagnosis/residuals.svg", "6 Diagnosis", "diagnosis_residuals"),
        ranking=page("diagnosis/ranking.svg", "6 Diagnosis", "diagnosis_ranking"),
    benchmark:
        f"{STUDY}/logs/diagnosis_identify.tsv"
    params:
        function="diagnosis.stages:diagnosis_identify",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: calibrate the base model, show where it fails and name the cause"
    script:
        "../scripts/task.py"


rule diagnose:
    input:
        factors=FACTORS,
        measurements=MEASUREMENTS,
        findings=f"{STUDY}/diagnosis/findings.json",
        extension=f"{STUDY}/diagnosis/extension.json",
        plan=f"{STUDY}/diagnosis/extension/plan.json",
        runs=runs_of("diagnosis/extension"),
    output:
        verdict=f"{STUDY}/diagnosis/verdict.json",
        page=page("diagnosis/diagnosis.md", "6 Diagnosis"),
        alone=f"{STUDY}/diagnosis/diagnosis.html",
        gain=page("diagnosis/gain.svg", "6 Diagnosis", "diagnosis_gain"),
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
        unpack(lambda w: training(0)),
        factors=FACTORS,
        measurements=MEASUREMENTS,
    output:
        power=f"{STUDY}/diagnosis/power.json",
        page=f"{STUDY}/diagnosis/power.md",
    benchmark:
        f"{STUDY}/logs/diagnosis_power.tsv"
    params:
        function="diagnosis.stages:diagnosis_power",
        reads=DIAGNOSIS_READS,
    message:
        "diagnosis: how strong a law must be for this plan to show it"
    script:
        "../scripts/task.py"
