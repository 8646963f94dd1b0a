"""Export: calibrated.yaml, and input for other codes, with the rolling friction that their laws
need."""

from calibration.study.config import Config
from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task, bench_values

BLOCKS = ("liggghts.in", "lammps.in", "yade.py", "mercurydpm.cpp")
FILES = (*BLOCKS, "edem.md", "dem.yaml", "study.yaml")
DECKS = ("liggghts/README.md", "lammps/README.md")  # beside each lies the deck that it describes
MODULE, READS = "calibration.telling.export.stage", (*PLANNED, "target")
FIXED = {"fixed": bench_values}
OPTIMUM = FIXED | {"optimum": "optimise/optimum.json"}


def named(file):
    """Name of an output: that of its file, as far as a name may have its characters."""
    return file.replace(".", "_").replace("/", "_")


STAGES = (
    # makes no run: part of `all`
    Stage(
        name="export",
        title="Export",
        place=9,
        tasks=(
            Task(
                f"{MODULE}:export",
                "export: calibrated.yaml and input for other codes",
                reads=tuple(Config.model_fields),
                inputs=OPTIMUM
                | {
                    "validation": "validation/validation.json",
                    "runs": "response_surface/runs.csv",
                    "region": "response_surface/region.json",
                    "candidate": "candidate/design.csv",
                },
                outputs={"parameters": Figure("calibrated.yaml", "export")}
                | {named(file): f"exports/{file}" for file in (*FILES, *DECKS)},
            ),
        ),
    ),
    # rolling friction means another torque in most codes: what gives the angle of their law is
    # searched with this engine's own version of it, see docs/howto-export.md
    Stage(
        name="exports/converted",
        title="Export with converted rolling friction",
        place=9.1,
        tasks=(
            Task(
                f"{MODULE}:plan_export_scan",
                "plan the export: rolling friction in the laws of other codes",
                reads=READS,
                inputs=OPTIMUM,
                plans="export_scan",
            ),
            Task(
                f"{MODULE}:plan_export_confirmation",
                "plan the export: runs with the rolling friction that was found",
                reads=READS,
                inputs=OPTIMUM | {"scan": "export_scan/design.csv", "runs": Runs("export_scan")},
                plans="export_confirmation",
            ),
            Task(
                f"{MODULE}:export_rolling",
                "export: the same angle with the rolling friction of other codes",
                reads=(*READS, "validation"),
                inputs=OPTIMUM
                | {
                    "scan": "export_scan/design.csv",
                    "confirmation": "export_confirmation/design.csv",
                    "validation": "validation/runs.csv",
                    "runs": Runs("export_confirmation"),
                },
                outputs={"rolling": "export_confirmation/rolling.json"},
            ),
            Task(
                f"{MODULE}:export_converted",
                "export: input for other codes, with the rolling friction that gives the angle "
                "there",
                reads=READS,
                inputs=OPTIMUM
                | {
                    "validation": "validation/validation.json",
                    "rolling": "export_confirmation/rolling.json",
                    "exported": "calibrated.yaml",
                },
                outputs={named(f): f"exports/converted/{f}" for f in (*BLOCKS, *DECKS)},
            ),
        ),
    ),
)
