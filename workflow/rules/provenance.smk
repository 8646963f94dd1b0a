# the study handed on: an RO-Crate, with all of its runs in one file. It makes no run, and holds the
# report, which so cannot show it


rule provenance:
    input:
        report=f"{STUDY}/report.html",
        shown=shown,
        also=also_shown,
        factors=FACTORS,
        measurements=measured,
    output:
        crate=f"{STUDY}/provenance/ro-crate-metadata.json",
        runs=f"{STUDY}/provenance/runs.csv",
        copies=[
            directory(f"{STUDY}/provenance/{copied}")
            for copied in ("inputs", "results")
        ],
    params:
        function="calibration.stages.provenance:provenance",
        reads=["factors", "measurements", "target"],
    message:
        "provenance: an RO-Crate of the study, and all runs in one file"
    script:
        "../scripts/task.py"
