# a study named in `reproduction.beside` counts where it has been run; its own workflow makes it
BESIDE = [
    f"results/{name}"
    for name in SETTINGS.reproduction.beside
    if name != SETTINGS.name
    and Path(f"results/{name}/validation/validation.json").exists()
]


rule reproduction:
    input:
        tables=sorted(str(path) for path in Path("data/paper").glob("*.csv")),
        factors=SETTINGS.factors,
        validation=f"{STUDY}/validation/validation.json",
        tilt=f"{STUDY}/tilt/tilt.json",
        drop=f"{STUDY}/drop/drop.json",
        shear=f"{STUDY}/shear/shear.json",
        scaling=f"{STUDY}/scaling/scaling.json",
        beside=[f"{folder}/validation/validation.json" for folder in BESIDE],
    output:
        table=report(
            f"{STUDY}/reproduction/reproduction.csv",
            caption="../report/reproduction.rst",
            category="12 Reproduction",
        ),
        summary=f"{STUDY}/reproduction/reproduction.json",
    log:
        f"{STUDY}/logs/reproduction.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
        studies=[STUDY, *BESIDE],
    message:
        "reproduction: every table and equation of the paper beside this study's values"
    script:
        "../scripts/reproduction.py"
