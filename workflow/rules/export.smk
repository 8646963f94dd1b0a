# makes no run: part of `all`
rule export:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        validation=f"{STUDY}/validation/validation.json",
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        candidate=f"{STUDY}/candidate/design.csv",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        parameters=report(
            f"{STUDY}/calibrated.yaml",
            caption="../report/export.rst",
            category="10 Export",
        ),
        blocks=expand(
            f"{STUDY}/exports/{{file}}",
            file=[
                "liggghts.in",
                "lammps.in",
                "yade.py",
                "mercurydpm.cpp",
                "edem.md",
                "dem.yaml",
                "study.yaml",
            ],
        ),
    log:
        f"{STUDY}/logs/export.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "export: calibrated.yaml and input for other codes"
    script:
        "../scripts/export.py"


# rolling friction means another torque in most codes: the angle of their law is searched with this engine's own version
# of it, see docs/howto-export.md
checkpoint plan_export_scan:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/export_scan/design.csv",
        plan=f"{STUDY}/export_scan/plan.json",
    log:
        f"{STUDY}/logs/plan_export_scan.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the export: rolling friction in the laws of other codes"
    script:
        "../scripts/plan_export_scan.py"


checkpoint plan_export_confirmation:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        design=f"{STUDY}/export_scan/design.csv",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
        runs=lambda w: results_of(checkpoints.plan_export_scan.get().output.plan),
    output:
        design=f"{STUDY}/export_confirmation/design.csv",
        plan=f"{STUDY}/export_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_export_confirmation.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the export: runs with the rolling friction that was found"
    script:
        "../scripts/plan_export_confirmation.py"


rule export_rolling:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        scan=f"{STUDY}/export_scan/design.csv",
        confirmation=f"{STUDY}/export_confirmation/design.csv",
        validation=f"{STUDY}/validation/runs.csv",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
        runs=lambda w: results_of(
            checkpoints.plan_export_confirmation.get().output.plan
        ),
    output:
        f"{STUDY}/export_confirmation/rolling.json",
    log:
        f"{STUDY}/logs/export_rolling.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "export: the same angle with the rolling friction of other codes"
    script:
        "../scripts/export_rolling.py"


rule export_converted:
    input:
        optimum=f"{STUDY}/optimise/optimum.json",
        validation=f"{STUDY}/validation/validation.json",
        rolling=f"{STUDY}/export_confirmation/rolling.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
        exported=rules.export.output,
    output:
        expand(
            f"{STUDY}/exports/converted/{{file}}",
            file=["liggghts.in", "lammps.in", "yade.py", "mercurydpm.cpp"],
        ),
    log:
        f"{STUDY}/logs/export_converted.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "export: input for other codes, with the rolling friction that gives the angle there"
    script:
        "../scripts/export_converted.py"
