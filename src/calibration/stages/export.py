"""Export: calibrated.yaml, and input for other codes, with the rolling friction that their laws
need."""

from calibration.study.stage import Plan, Stage

STAGES = (
    Stage(name="export", title="Export", place=9),
    Stage(
        name="exports/converted",
        title="Export with converted rolling friction",
        place=9.1,
        plans=(Plan("export_scan"), Plan("export_confirmation"), Plan("export_correction")),
        made_by="export_converted",
    ),
)
