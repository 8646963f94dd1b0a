"""Provenance: the study as an RO-Crate, with all of its runs in one file."""

from calibration.study.stages.stage import Stage, Task

CRATE = "provenance"
"""Folder of a study's results that holds copies of the others."""

STAGES = (
    # makes no run; it holds the report, which so cannot show it
    Stage(
        name=CRATE,
        title="Provenance",
        place=9.9,
        tasks=(
            Task(
                "calibration.telling.provenance:provenance",
                "provenance: an RO-Crate of the study, and all runs in one file",
                reads=("factors", "measurements", "target"),
                inputs={"report": "report.html"},
                outputs={
                    "crate": f"{CRATE}/ro-crate-metadata.json",
                    "runs": f"{CRATE}/runs.nc",
                },
            ),
        ),
    ),
)
