# made from whatever stages have finished; `all` makes the chain first
rule report:
    input:
        validation=f"{STUDY}/validation/validation.json",
        audit=f"{STUDY}/audit/audit.csv",
        tilt=f"{STUDY}/tilt/tilt.json",
        drop=f"{STUDY}/drop/drop.json",
        shear=f"{STUDY}/shear/shear.json",
    output:
        f"{STUDY}/report.html",
    log:
        f"{STUDY}/logs/report.log",
    conda:
        "../envs/calibration.yaml"
    message:
        "report: {output}"
    script:
        "../scripts/report.py"
