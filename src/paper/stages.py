"""The stages that concern the paper alone, for a study that names one of them in its
supplements."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from calibration.study.stage import Stage

if TYPE_CHECKING:
    from calibration.chain.study import Study


TABLES = Path("data/paper")
SETTINGS = "config/reproduction.yaml"
FURTHER = {
    "beside": ("validation/validation.json",),
    "repeats": ("screening/runs.csv", "response_surface/runs.csv"),
}
"""What counts beside a study: the validations of others, and the screenings and the response
surfaces of the same at other seeds."""


def tables(study: Study) -> list[str]:
    """The paper's printed tables."""
    return sorted(str(path) for path in TABLES.glob("*.csv"))


def further(study: Study) -> Iterator[list[str]]:
    """For each key of FURTHER its files of the studies that SETTINGS has under it, where they have
    been run."""
    named = yaml.safe_load(Path(SETTINGS).read_text("utf-8"))
    for key, files in FURTHER.items():
        names = named[key].get(study.name, ())
        paths = (study.folder.parent / n / f for n in names for f in files)
        yield [str(path) for path in paths if path.exists()]


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
)
