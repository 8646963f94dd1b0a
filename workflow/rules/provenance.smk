# the study handed on: an RO-Crate, with all of its runs in one file. It makes no run, and holds the
# report, which so cannot show it


rule provenance:
    input:
        report=f"{STUDY}/report.html",
        shown=shown,
        also=also_shown,
        factors=FACTORS,
        measurements=measured,
        again=again("provenance"),
    output:
        crate=f"{STUDY}/provenance/ro-crate-metadata.json",
        runs=f"{STUDY}/provenance/runs.nc",
    log:
        f"{STUDY}/logs/provenance.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        function="calibration.telling.provenance:provenance",
        reads=["factors", "measurements", "target"],
        made_from=made_from("provenance"),
    message:
        "provenance: an RO-Crate of the study, and all runs in one file"
    script:
        "../scripts/task.py"
