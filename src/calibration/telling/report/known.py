"""What the stages found, as several sections of the page tell it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calibration.figures import label

if TYPE_CHECKING:
    from calibration.chain.study import Results


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
