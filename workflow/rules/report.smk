SUPPLEMENTS = {"audit": "audit.csv"} | {
    test: f"{test}.json" for test in ("tilt", "drop", "shear")
}


# made from whatever stages have finished; `all` makes the chain and the configured supplements first
rule report:
    input:
        validation=f"{STUDY}/validation/validation.json",
        supplements=[
            f"{STUDY}/{name}/{SUPPLEMENTS[name]}" for name in SETTINGS.supplements
        ],
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
