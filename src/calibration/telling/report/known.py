"""What the stages found, as several sections of the page tell it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import yaml

from calibration.figures import label

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.chain.study import Results
    from calibration.figures import Response


POOR = 0.5  # predicted R2 below which a surface predicts little


def predicts(results: Results) -> bool:
    """Whether the response surface of a folder's `Results` predicts more than little; true where it
    has none, or no measure of it."""
    surface = results.summary("response_surface", "response_surface") or {}
    predicted = surface.get("statistics", {}).get("R2_pred")
    return predicted is None or predicted >= POOR


def said_by_diagnosis(verdict: Mapping[str, Any]) -> list[str]:
    """Sentences of a mapping of verdict.json: its own first lines, or of one without them the
    verdict with causes and reason."""
    if verdict.get("first_lines"):
        return verdict["first_lines"]
    causes = " and ".join(label(c) for c in verdict.get("causes", []))
    parts = [verdict["verdict"], causes, verdict.get("reason", "").strip().rstrip(".")]
    return [f"The diagnosis: {': '.join(p for p in parts if p)}."]


def of_one_test(study: Path, response: Response) -> tuple[list[str], str]:
    """The tests that were given beside the calibrated one, and a sentence that says so; none and ""
    where there are none. study: folder; response: of the calibrated test."""
    path = study / "calibrated.yaml"
    found = yaml.safe_load(path.read_text("utf-8")) if path.is_file() else {}
    others = found.get("target", {}).get("other_tests", [])
    if not others:
        return [], ""
    together = (
        "A set by all tests stands under “Parameters for other codes”."
        if (study / "joint_export" / "calibrated.yaml").is_file()
        else "calibration run STUDY joint_export makes a set by all tests."
    )
    return others, (
        f"The parameters of this page come from the {response.name} alone. Given, but not in these "
        f"numbers: {'; '.join(others)}. {together}"
    )


def posterior_of(results: Results) -> dict[str, Any] | None:
    """Content of posterior.json of `Results`; None where there is none, or where the optimum has
    moved to another region or target since."""
    found, optimum = results.summary("posterior", "posterior"), results.summary("optimise")
    if found is None or optimum is None:
        return found
    region = {f["name"]: (f["low"], f["high"]) for f in optimum.get("region", [])}
    moved = any(tuple(found["box"].get(name, ends)) != ends for name, ends in region.items())
    means = [t["mean"] for t in found.get("targets", {}).values()][:1]  # the main one comes first
    if moved or not all(math.isclose(m, optimum["target"]) for m in means):
        return None
    return found
