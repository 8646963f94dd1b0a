"""The stages that concern the paper alone, for a study that names one of them in its
supplements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from calibration.study.stages import Plan, Stage

if TYPE_CHECKING:
    from calibration.chain.study import Study


TABLES = Path("data/paper")
SETTINGS = "config/reproduction.yaml"
CAUSES = "config/disagreement.yaml"
SIMULATED = ("table_6", "table_8", "table_9", "table_10", "table_11")
"""The paper's tables of simulated values, as tables of another code's runs."""


def tables(study: Study) -> list[str]:
    """The paper's printed tables."""
    return sorted(str(path) for path in TABLES.glob("*.csv"))


def beside(study: Study) -> list[str]:
    """The validations of the further studies that count beside this one, where they have been
    run."""
    from paper.reproduction.settings import read_reproduction

    names = read_reproduction(SETTINGS).beside.get(study.name, ())
    paths = (study.folder.parent / n / "validation" / "validation.json" for n in names)
    return [str(path) for path in paths if path.exists()]


def repeats(study: Study) -> list[str]:
    """The screenings of the same study at other seeds, and their response surfaces, where they have
    been run."""
    from paper.reproduction.settings import read_reproduction

    names = read_reproduction(SETTINGS).repeats.get(study.name, ())
    stages = ("screening", "response_surface")
    paths = (study.folder.parent / n / stage / "runs.csv" for n in names for stage in stages)
    return [str(path) for path in paths if path.exists()]


def causes(study: Study) -> str:
    """The file of what may differ between the paper's simulations and a study's."""
    from paper.reproduction.settings import read_reproduction

    return read_reproduction(SETTINGS).causes.get(study.name, CAUSES)


STAGES = (
    Stage(
        name="audit",
        title="The paper's arithmetic",
        place=12,
        about="Every printed figure and statement, recomputed from the paper's own tables; "
        "disagreements come "
        "first.",
        tables=(("audit", "Audit"),),
        unshown=("id",),
    ),
    Stage(
        name="reproduction",
        title="This study beside the paper",
        place=10,
        about="Each printed result of the paper beside ours.",
        tables=(("reproduction", "Reproduction"),),
        unshown=("id", "headline", "study", "n", "low", "high"),
    ),
    Stage(
        name="disagreement",
        title="Why the two simulations disagree",
        place=10.1,
        plans=(Plan("disagreement", batches=8, failures="kept"),),
    ),
)
