# a picture of each run of a stage; seconds a stage, so one job draws them all
rule heaps:
    input:
        design=f"{STUDY}/{{stage}}/design.csv",
        runs=lambda w: results_of(
            getattr(checkpoints, f"plan_{w.stage}").get().output.plan
        ),
    output:
        report(
            directory(f"{STUDY}/heaps/{{stage}}"),
            patterns=["{run}.webp"],
            caption="../report/heaps.rst",
            category="8 Heaps",
            subcategory="{stage}",
        ),
    log:
        f"{STUDY}/logs/heaps_{{stage}}.log",
    wildcard_constraints:
        stage="screening|ascent|response_surface|candidate|validation",
    conda:
        "../envs/calibration.yaml"
    message:
        "heaps: a picture of each run of {wildcards.stage}"
    script:
        "../scripts/render_stage.py"
