rule audit:
    input:
        tables=sorted(str(path) for path in Path("data/paper").glob("*.csv")),
    output:
        table=f"{STUDY}/audit/audit.csv",
        page=report(
            f"{STUDY}/audit/audit.html",
            caption="../report/audit.rst",
            category="6 Audit of the paper",
        ),
    log:
        f"{STUDY}/logs/audit.log",
    conda:
        "../envs/calibration.yaml"
    message:
        "audit: recompute every printed figure of the paper"
    script:
        "../scripts/audit.py"
