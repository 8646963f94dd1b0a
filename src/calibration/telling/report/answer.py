"""The answer, before anything else, as the page shows it: all of it from answer.json, with the
solution set of the surface beneath; and what the chain's runs say: what decides, and what to know
of them; and the page's profiler: the response surfaces with their covariance, for the page to
evaluate."""

import json
from html import escape
from pathlib import Path
from typing import Any

import scipy

from calibration.chain.study import Results
from calibration.errors import CalibrationError
from calibration.figures import PLACES, Response, label, response_of
from calibration.intake.tables import read_written
from calibration.statistics.surface import fit_surface
from calibration.telling.answer import words
from calibration.telling.answer.schema import answer_of
from calibration.telling.answer.words import given_nowhere, said
from dem.advice import limits_of
from dem.errors import DemError
from dem.spec import load_spec
from dem.units import unit_of, without_unit


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
            for p in answered.parameters
            if p.source == "calibrated"
        ],
        "tests": [words.compared(t) | {"state": t.state} for t in answered.tests],
        "wrong": answered.wrong.sentence,
        "right": answered.wrong.verdict in ("met", "adequate") and predicts(Results(study)),
        "beside": [words.beside(b) for b in answered.beside],
        "next": " ".join(said("next", answered.next)) if answered.next else "",
        "block": [*_block(answered), *_time_step(study)],
        "solution": _solution(study, optimum) if optimum and answered.by == "chain" else [],
        "notes": [*(said("optimum", optimum, response) if optimum else []), *_limits(study)],
    }


def _block(answered):
    """Rows {heading: text} of every parameter, those of the contacts first."""
    rows = []
    for place, where in PLACES.items():
        for p in (p for p in answered.parameters if p.key.startswith(f"{place}.")):
            name = label(without_unit(p.key.rpartition(".")[2]))
            rows.append(_row(where, name, words.number(p), p.unit, _known(p)))
    return rows


def _row(*texts):
    return dict(zip(("where", "parameter", "value", "unit", "how it is known"), texts, strict=True))


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
    return [_row("simulator", "time step", f"{time_step_of(spec):.4g}", "s", fraction)]


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


POOR = 0.5  # predicted R2 below which a surface predicts little


def predicts(results: Results) -> bool:
    """Return whether the response surface of a folder's `Results` predicts more than little; true
    where it has none, or no measure of it."""
    surface = results.summary("response_surface", "response_surface") or {}
    predicted = surface.get("statistics", {}).get("R2_pred")
    return predicted is None or predicted >= POOR


def findings(study: Path, response: Response) -> list[tuple[str, str]]:
    """[(heading, text)] for the page's first screen; only what the study's files hold."""
    screening = Results(study).summary("screening", "screening")
    found = []
    effects = _effects(study)
    if screening and effects is not None:
        decides = said("decides", effects.to_dict("records"), screening, response)
        found.append(("What decides", " ".join(decides)))
    odd = _left_out(screening, response) if screening else []
    if surface := Results(study).summary("response_surface", "response_surface"):
        odd += said("surface", surface, POOR)
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


def _left_out(screening, response):
    """A sentence on the largest effect that was left out, where others went on that are smaller."""
    effects, on = screening.get("effects", {}), screening["factors"]
    largest = max((n for n in effects if n not in on), key=lambda n: abs(effects[n]), default=None)
    smaller = [n for n in on if n in effects and abs(effects[n]) < abs(effects.get(largest, 0.0))]
    why = screening.get("why", {})
    reasons = dict.fromkeys(why.get(n, "the configured path prefers it") for n in smaller)
    return said("left_out", screening, largest, smaller, reasons, response) if smaller else []


def profiler(study: Path, response: Response) -> str | None:
    """JSON of factors and responses, or None where no surface was fitted.

    Each response has terms, coefficients and their covariance, the calibrated one first. The
    surfaces are the stage's own, of the runs in its table; the optimum's has more runs.
    """
    region = Results(study).summary("response_surface", "region")
    optimum = Results(study).summary("optimise", "optimum")
    path = study / "response_surface" / "runs.csv"
    if not (region and optimum and path.exists()):
        return None
    runs, codes = read_written(path), [f["code"] for f in region]
    if "response" not in runs or not set(codes) <= set(runs):
        return None
    main = _surface(runs, codes, "response", response, optimum["target"])
    if main is None:
        return None
    factors = [_factor(f, optimum) for f in region]
    data = {"factors": factors, "responses": [main, *_further(study, runs, codes)]}
    return json.dumps(data).replace("<", "\\u003c")  # nothing in a name ends the script


def _factor(factor, optimum):
    value = optimum["optimum"].get(factor["name"], 0.5 * (factor["low"] + factor["high"]))
    return {
        "name": escape(label(factor["name"])),
        "key": factor["key"],
        "low": factor["low"],
        "high": factor["high"],
        "value": value,
    }


def _further(study, runs, codes):
    """The surfaces of the further targets, each in the runs' column of its metric; target None
    where it was not measured."""
    validation = Results(study).summary("validation", "validation") or {}
    found = (
        _surface(runs, codes, metric, response_of(metric), one.get("measured_mean"))
        for metric, one in validation.get("further", {}).items()
        if metric in runs
    )
    return [surface for surface in found if surface]


def _surface(runs, codes, column, response, target):
    """A fitted response for the page, or None where the runs do not carry one."""
    runs = runs.dropna(subset=[column])
    try:
        surface = fit_surface(runs, codes, runs[column])
    except CalibrationError:
        return None
    place = {code: k for k, code in enumerate(codes)}
    return {
        "terms": [[place[c] for c in term] for term in surface.terms],
        "beta": [float(b) for b in surface.beta],
        "covariance": (surface.sigma2 * surface.inverse).tolist(),
        "t": float(scipy.stats.t.ppf(0.975, surface.df)) if surface.df > 0 else None,
        "target": target,
        "unit": response.unit,
        "name": response.name,
    }
