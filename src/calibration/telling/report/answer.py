"""The answer, before anything else, as the page shows it: all of it from answer.json, with the
solution set of the surface beneath; and what the chain's runs say: what decides, and what to know
of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calibration.chain.study import Results
from calibration.figures import PLACES, label
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed, signed
from calibration.telling.answer import words
from calibration.telling.answer.schema import answer_of
from calibration.telling.answer.words import given_nowhere, out_of_reach
from dem.advice import limits_of
from dem.errors import DemError
from dem.spec import load_spec
from dem.units import unit_of, without_unit

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from calibration.figures import Response


def answer(study: Path, response: Response) -> dict[str, Any] | None:
    """Mapping for the page, None where the stage `answer` has not run: `first` (each calibrated
    parameter in brief), `tests` (rows of every measured value), `by`, `wrong`, `right` (whether
    nothing is), `beside`, `next`, `block` (rows of every parameter), `solution` (rows of the
    surface's) and `notes`."""
    answered = answer_of(Results(study))
    if answered is None:
        return None
    optimum = Results(study).summary("optimise", "optimum")
    return {
        "by": "all tests together" if answered.by == "joint" else f"the {response.name} alone",
        "first": [
            {"name": p.name, "value": words.value(p), "known": words.known(p)}
            for p in words.calibrated(answered)
        ],
        "tests": [words.compared(t) | {"state": t.state} for t in answered.tests],
        "wrong": answered.wrong.sentence,
        "right": answered.wrong.verdict in ("met", "adequate") and predicts(Results(study)),
        "beside": [words.beside(b) for b in answered.beside],
        "next": words.following(answered),
        "block": [*_block(answered), *_time_step(study)],
        "solution": _solution(study, optimum) if optimum and answered.by == "chain" else [],
        "notes": [*(_notes(optimum, response) if optimum else []), *_limits(study)],
    }


def _block(answered):
    """Rows {heading: text} of every parameter, those of the contacts first."""
    rows = []
    for place, words_of in PLACES.items():
        for p in (p for p in answered.parameters if p.key.startswith(f"{place}.")):
            rows.append(
                {
                    "where": words_of,
                    "parameter": label(without_unit(p.key.rpartition(".")[2])),
                    "value": words.number(p),
                    "unit": p.unit,
                    "how it is known": _known(p),
                }
            )
    return rows


def _known(parameter):
    known = words.known(parameter)
    return known if known == parameter.source else f"{parameter.source}; {known}"


def _time_step(study):
    """The row of the time step, of the run spec among the exports."""
    from dem.experiments.setup import time_step_of  # loads the engine

    try:
        spec = load_spec(study / "exports" / "dem.yaml")
    except DemError:
        return []
    fraction = f"{spec.numerics.rayleigh_fraction:g} of the Rayleigh time of the smallest grain"
    return [
        {
            "where": "simulator",
            "parameter": "time step",
            "value": f"{time_step_of(spec):.4g}",
            "unit": "s",
            "how it is known": fraction,
        }
    ]


def _solution(study, optimum):
    """Rows {heading: text} of the calibrated parameters over the surface's solution set."""
    region = Results(study).summary("response_surface", "region") or []
    units = {f["name"]: unit for f in region if (unit := unit_of(f["key"]))}
    if given_nowhere(optimum):
        return []
    rows = []
    for name, (low, high) in optimum["solution_set"].items():
        unit = f" [{units[name]}]" if name in units else ""
        over = f"{low:.4g} to {high:.4g}"
        rows.append({"parameter": f"{label(name)}{unit}", "over the solution set": over})
    return rows


def _limits(study):
    """Where the laws of the calibrated run spec make the result hold, and where not."""
    run = study / "exports" / "dem.yaml"
    return [f"{text}." for text in limits_of(load_spec(run))] if run.is_file() else []


def _notes(optimum, response):
    if given_nowhere(optimum):
        return [out_of_reach(optimum, response)]
    if "desirability" in optimum:
        return [
            f"The point above is the most desirable compromise of several targets (desirability "
            f"{optimum['desirability']:.2f})."
        ]
    low, high = optimum["confirmation_interval"]
    return [
        f"The {response.name} alone does not fix the parameters: every point of the solution set "
        f"gives "
        f"{response.value(optimum['target'])}; the point above is the one that the rule "
        f"“{label(optimum['rule'])}” chose. The mean of {optimum['confirmation_runs']} runs there "
        f"was expected between "
        f"{response.value(low)} and {response.value(high)} (95 %)."
    ]


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
