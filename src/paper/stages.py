"""The stages that concern the paper alone, for a study that names one of them in its
supplements."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from calibration.study.stage import Plan, Stage

if TYPE_CHECKING:
    from calibration.chain.study import Study


TABLES = Path("data/paper")
SETTINGS = "config/reproduction.yaml"
CAUSES = "config/disagreement.yaml"
FURTHER = {
    "beside": ("validation/validation.json",),
    "repeats": ("screening/runs.csv", "response_surface/runs.csv"),
}
"""What counts beside a study: the validations of others, and the screenings and the response
surfaces of the same at other seeds."""
SIMULATED = ("table_6", "table_8", "table_9", "table_10", "table_11")
"""The paper's tables of simulated values, as tables of another code's runs."""


def tables(study: Study) -> list[str]:
    """The paper's printed tables."""
    return sorted(str(path) for path in TABLES.glob("*.csv"))


def _of(key, study):
    """What SETTINGS has of a study under a key; None without."""
    return yaml.safe_load(Path(SETTINGS).read_text("utf-8"))[key].get(study.name)


def further(study: Study) -> Iterator[list[str]]:
    """For each key of FURTHER its files of the studies that SETTINGS has under it, where they have
    been run."""
    for key, files in FURTHER.items():
        paths = (study.folder.parent / n / f for n in _of(key, study) or () for f in files)
        yield [str(path) for path in paths if path.exists()]


def causes(study: Study) -> str:
    """The file of what may differ between the paper's simulations and a study's."""
    return _of("causes", study) or CAUSES


STAGES = (
    Stage(
        name="audit",
        title="The paper's arithmetic",
        place=12,
        about="Every printed figure and statement, recomputed from the paper's own tables; "
        "disagreements come first.",
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
