"""What the chain's runs say, in sentences made from the results: what decides, and what to know of
the runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calibration.chain.study import Results
from calibration.figures import label
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed, signed

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from calibration.figures import Response


POOR = 0.5  # predicted R2 below which a surface predicts little


def predicts(results: Results) -> bool:
    """Whether the response surface of a folder's `Results` predicts more than little; true where it
    has none, or no measure of it."""
    surface = results.summary("response_surface", "response_surface") or {}
    predicted = surface.get("statistics", {}).get("R2_pred")
    return predicted is None or predicted >= POOR


def findings(study: Path, response: Response) -> list[tuple[str, str]]:
    """[(heading, text)] for the page's first screen; only what the study's files hold."""
    screening = Results(study).summary("screening", "screening")
    found = []
    effects = _effects(study)
    if screening and effects is not None:
        found.append(("What decides", decides(effects, screening, response)))
    odd = [*_screened(screening, response), *_fitted(study)]
    if odd:
        found.append(("What to know of the runs", " ".join(odd)))
    return found


def _effects(study):
    """The screening's table of effects, the largest first; None where it has not run."""
    path = study / "screening" / "effects.csv"
    table = read_written(path) if path.exists() else None
    if table is None or not {"name", "effect"} <= set(table):
        return None
    return table.sort_values("effect", key=abs, ascending=False)


def decides(effects: pd.DataFrame, screening: Mapping[str, Any], response: Response) -> str:
    """The largest effect with its share of the screening's scatter, and the other significant
    ones."""
    first = effects.iloc[0]
    share = (
        f", {first['contribution_percent']:.0f} % of what the screening's heaps differ by"
        if "contribution_percent" in effects
        else ""
    )
    text = (
        f"{_name(first['name'])} decides: {_effect(first['effect'], response)} over its "
        f"range{share}."
    )
    others = [n for n in screening["significant"] if n != first["name"]]
    sizes = dict(zip(effects["name"], effects["effect"], strict=True))
    if others:
        named = ", ".join(f"{_between(n)} ({_effect(sizes[n], response)})" for n in others)
        return f"{text} Also significant: {named}."
    return f"{text} No other effect is significant at p < {screening['alpha']:g}."


def _screened(screening, response):
    """The largest effect that was left out, where others went on that are smaller."""
    if not screening:
        return []
    effects, on = screening.get("effects", {}), screening["factors"]
    left = {n: e for n, e in effects.items() if n not in on}
    if not left:
        return []
    largest = max(left, key=lambda n: abs(left[n]))
    smaller = [n for n in on if n in effects and abs(effects[n]) < abs(left[largest])]
    if not smaller:
        return []
    than = " and ".join(f"{_between(n)} ({_effect(effects[n], response)})" for n in smaller)
    return [
        f"{_name(largest)} ({_effect(left[largest], response)}) is not calibrated, though it moves "
        f"the response more than {than}: {_why(screening, smaller)}."
    ]


def _why(screening, names):
    """Why these went on, each reason once."""
    why = screening.get("why", {})
    reasons = dict.fromkeys(why.get(n, "the configured path prefers it") for n in names)
    return ", ".join(NAMED if reason.startswith("named by") else reason for reason in reasons)


NAMED = "the configuration names what is calibrated (screening.go_on)"


def _fitted(study):
    """Odd points, lack of fit, and a surface that predicts little."""
    surface = Results(study).summary("response_surface", "response_surface")
    if not surface:
        return []
    found = []
    for odd in surface.get("outliers", []):
        found.append(
            f"Run {odd['run']} of the response surface lies {odd['studentised']:.1f} standard "
            f"deviations off the surface; up to {surface['outlier_limit']:.1f} is expected."
        )
    s = surface["statistics"]
    lack, predicted = s.get("lack_of_fit_p"), s.get("R2_pred")
    if lack is not None and lack < 0.05:
        found.append(f"The surface does not follow the heaps (lack of fit p = {lack:.2g}).")
    if predicted is not None and predicted < POOR:
        found.append(f"The surface predicts little (predicted R² {fixed(predicted, 2)}).")
    return found


def _between(name):
    """A factor's name in a sentence: what two grains do is `between grains`."""
    return re.sub(r" of (\w+) on \1$", " between grains", label(name))


def _name(name):
    return _between(name)[0].upper() + _between(name)[1:]


def _effect(value, response):
    return f"{signed(value)}{response.unit}"
