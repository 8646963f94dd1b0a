"""The stages that concern the paper alone, for a study that names one of them in its
supplements."""

from pathlib import Path

from calibration.study.stages import Figure, Runs, Stage, Task
from calibration.study.stages.stage import PLANNED

TABLES = Path("data/paper")
SETTINGS = "config/reproduction.yaml"
CAUSES = "config/disagreement.yaml"
SIMULATED = ("table_6", "table_8", "table_9", "table_10", "table_11")
"""The paper's tables of simulated values, as tables of another code's runs."""


def tables(study):
    """The paper's printed tables."""
    return sorted(str(path) for path in TABLES.glob("*.csv"))


def beside(study):
    """The validations of the further studies that count beside this one, where they have been
    run."""
    from paper.reproduction.settings import read_reproduction

    names = read_reproduction(SETTINGS).beside.get(study.name, ())
    paths = (study.folder.parent / n / "validation" / "validation.json" for n in names)
    return [str(path) for path in paths if path.exists()]


def repeats(study):
    """The screenings of the same study at other seeds, where they have been run."""
    from paper.reproduction.settings import read_reproduction

    names = read_reproduction(SETTINGS).repeats.get(study.name, ())
    paths = (study.folder.parent / n / "screening" / "runs.csv" for n in names)
    return [str(path) for path in paths if path.exists()]


STAGES = (
    Stage(
        name="audit",
        title="The paper's arithmetic",
        category="Audit of the paper",
        place=12,
        about="Every printed figure and statement, recomputed from the paper's own tables; "
        "disagreements come "
        "first.",
        unshown=("id",),
        tasks=(
            Task(
                "paper.tasks:audit",
                "audit: recompute every printed figure of the paper",
                inputs={"tables": tables},
                outputs={
                    "table": "audit/audit.csv",
                    "page": Figure("audit/audit.html", "audit"),
                },
            ),
        ),
    ),
    Stage(
        name="reproduction",
        title="This study beside the paper",
        category="Reproduction",
        place=10,
        about="Each printed result of the paper beside ours.",
        unshown=("id", "headline", "study", "n", "low", "high"),
        tasks=(
            Task(
                "paper.tasks:reproduction",
                "reproduction: every table and equation of the paper beside this study's values",
                reads=("run", "factors"),
                inputs={
                    "tables": tables,
                    "settings": lambda study: SETTINGS,
                    "beside": beside,
                    "repeats": repeats,
                    "validation": "validation/validation.json",
                    "tilt": "tilt/tilt.json",
                    "drop": "drop/drop.json",
                    "shear": "shear/shear.json",
                    "scaling": "scaling/scaling.json",
                },
                outputs={
                    "table": Figure("reproduction/reproduction.csv", "reproduction"),
                    "summary": "reproduction/reproduction.json",
                },
            ),
        ),
    ),
    Stage(
        name="disagreement",
        title="Why the two simulations disagree",
        category="Reproduction",
        place=10.1,
        tasks=(
            Task(
                "paper.disagreement:plan_disagreement",
                "disagreement: read the paper's tables as runs, plan what may differ at each",
                reads=(*PLANNED, "bench"),
                inputs={"tables": tables, "causes": lambda study: CAUSES},
                outputs={name: f"disagreement/{name}.csv" for name in SIMULATED},
                plans="disagreement",
                batches=8,
                failures="kept",
            ),
            Task(
                "paper.disagreement:disagreement",
                "disagreement: the cause of each table's, or that none tried explains it",
                reads=("experiment", "fixed", "run", "factors", "diagnosis"),
                inputs={
                    "tables": tables,
                    "causes": lambda study: CAUSES,
                    "settings": lambda study: study.config.diagnosis.get("settings") or [],
                    "design": "disagreement/design.csv",
                    "plan": "disagreement/plan.json",
                    "runs": Runs("disagreement"),
                    "screening": "screening/runs.csv",
                    "ascent": "ascent/runs.csv",
                    "response_surface": "response_surface/runs.csv",
                    "beside": beside,
                }
                | {name: f"disagreement/{name}.csv" for name in SIMULATED},
                outputs={
                    "summary": "disagreement/disagreement.json",
                    "page": Figure("disagreement/disagreement.md", "disagreement"),
                },
            ),
        ),
    ),
)
