SUPPLEMENTS = {"audit": "audit.csv", "reproduction": "reproduction.csv"} | {
    test: f"{test}.json" for test in ("tilt", "drop", "shear", "scaling")
}
# what the page shows too when it has been made, but does not wait for
ALSO_SHOWN = {
    "diagnosis",
    "numerics",
    "scaling",
    "reproduction",
    "exports/converted",
} - set(SETTINGS.supplements)


# made from whatever stages have finished; `all` makes the chain and the configured supplements first
rule report:
    input:
        validation=f"{STUDY}/validation/validation.json",
        heaps=expand(
            f"{STUDY}/heaps/{{stage}}",
            stage=[
                "screening",
                "ascent",
                "response_surface",
                "candidate",
                "validation",
            ],
        ),
        supplements=[
            f"{STUDY}/{name}/{SUPPLEMENTS[name]}" for name in SETTINGS.supplements
        ],
        exports=rules.export.output,
    output:
        report(
            f"{STUDY}/report.html",
            caption="../report/report.rst",
            category="0 The whole study",
        ),
    log:
        f"{STUDY}/logs/report.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
        # with its time: the page is written anew when it changes. It is no input, as that would make what nobody asked for
        beside=lambda w: {
            str(path): int(path.stat().st_mtime)
            for name in sorted(ALSO_SHOWN)
            for path in sorted(Path(STUDY, name).glob("*.*"))
        },
    message:
        "report: {output}"
    script:
        "../scripts/report.py"
