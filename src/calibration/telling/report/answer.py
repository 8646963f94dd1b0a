"""The answer, before anything else: parameters with their intervals, the validated value, the
verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calibration.chain.optimum import given_nowhere, out_of_reach
from calibration.chain.study import Results
from calibration.chain.validation import judged
from calibration.figures import label, response_of
from calibration.statistics.numbers import difference_of
from calibration.telling.report.known import posterior_of, predicts, said_by_diagnosis
from dem.advice import limits_of
from dem.spec import load_spec
from dem.units import unit_of

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.figures import Response


OTHERS_HELD = "interval_95_others_held"
NOT_BOUNDED = "not bounded within"


def answer(study: Path, response: Response) -> dict[str, Any]:
    """Mapping for the page: `first` (each calibrated parameter in brief), `parameters` (rows of the
    table), `tiles` and `notes`."""
    optimum = Results(study).summary("optimise", "optimum")
    region = Results(study).summary("response_surface", "region") or []
    validation = Results(study).summary("validation", "validation")
    verdict = Results(study).summary("diagnosis", "verdict")
    posterior = posterior_of(Results(study))
    tiles = [
        *(_validated(validation, response) if validation else []),
        *(_equivalence(validation, response) if validation else []),
        *(_further(validation) if validation else []),
        *(_diagnosed(verdict) if verdict else []),
    ]
    rows = _parameters(optimum, region, verdict, posterior) if optimum else []
    if not predicts(Results(study)):
        tiles = [_not_green(tile) for tile in tiles]
    return {
        "first": [_first(row) for row in rows],
        "parameters": rows,
        "tiles": tiles,
        "notes": [*(_notes(optimum, response) if optimum else []), *_limits(study)],
    }


def _first(row):
    """A calibrated parameter in brief: its name, its value, how it is known."""
    known = next((f"{name}: {text}" for name, text in row.items() if name.startswith("95 %")), "")
    return {"name": row["parameter"], "value": row["calibrated"], "known": known}


def _not_green(tile):
    """A tile that calls nothing good: the surface that led to it predicts little."""
    if tile.get("good") is not True:
        return tile
    return tile | {"good": None, "text": f"{tile['text']}; but the surface predicts little"}


def _limits(study):
    """Where the laws of the calibrated run spec make the result hold, and where not."""
    run = study / "exports" / "dem.yaml"
    return [f"{text}." for text in limits_of(load_spec(run))] if run.is_file() else []


def _parameters(optimum, region, verdict, posterior):
    """Rows {heading: text} of the calibrated parameters: value, interval of the posterior, or where
    it has not run the one with the others held; extent of the solution set, interval of the
    diagnosis where there is one."""
    diagnosed = (verdict or {}).get("calibration", {})
    borders = {f["name"]: (f["low"], f["high"]) for f in region}
    units = {f["name"]: unit for f in region if (unit := unit_of(f["key"]))}
    rows = []
    for name, value in optimum["optimum"].items():
        low, high = optimum["solution_set"][name]
        unit = f" [{units[name]}]" if name in units else ""
        row = {"parameter": f"{label(name)}{unit}", "calibrated": f"{value:.4g}"}
        interval = ""
        if posterior:
            row["95 %"] = interval = _of_posterior(posterior, name)
        elif OTHERS_HELD in optimum:
            interval = _interval(optimum[OTHERS_HELD][name], borders[name])
            row["95 % only if the others are right"] = interval
        if interval.startswith(NOT_BOUNDED):
            row["calibrated"] = f"{value:.2g}"  # more digits would say that it is known
        if not given_nowhere(optimum):
            row["over the solution set"] = f"{low:.4g} to {high:.4g}"
        if diagnosed:
            p = diagnosed.get(name)
            row["95 % by all measurements"] = f"{p['low']:.3g} to {p['high']:.3g}" if p else ""
        rows.append(row)
    return rows


def _of_posterior(posterior, name):
    """Words for the interval of a parameter, whatever the others are."""
    found = posterior["parameters"].get(name)
    if found is None:
        return ""
    if not found["bounded"]:
        low, high = posterior["box"][name]
        return f"{NOT_BOUNDED} {low:.4g} to {high:.4g}"
    low, high = found["interval"]
    return f"{low:.4g} to {high:.4g}"


def _interval(interval, borders):
    """Words for an interval whose ends may be the borders of the region searched, where the data do
    not bound it."""
    (low, high), (first, last) = interval, borders
    width = last - first
    open_below, open_above = low - first < 1e-6 * width, last - high < 1e-6 * width
    if open_below and open_above:
        return f"{NOT_BOUNDED} {first:.4g} to {last:.4g}"
    if open_below:
        return f"below {high:.4g}"
    return f"above {low:.4g}" if open_above else f"{low:.4g} to {high:.4g}"


def _validated(v, response):
    return [
        {
            "name": f"Validated {response.name}",
            "value": response.value(v["simulated_mean"]),
            "text": f"measured {response.value(v['measured_mean'])}: "
            f"{v['relative_error_percent']:.2f} % apart, "
            f"{v['simulated_n']} runs with seeds of their own",
        }
    ]


def _further(v):
    """A tile of each further target: beside its measurement where it has one."""
    tiles = []
    for metric, found in v.get("further", {}).items():
        response = response_of(metric)
        if "measured_mean" in found:
            tiles += [_validated(found, response)[0] | {"good": found["equivalent"]}]
        else:
            value = response.value(found["simulated_mean"])
            tiles += [{"name": response.name.capitalize(), "value": value, "text": "not measured"}]
    return tiles


def _equivalence(v, response):
    apart, low, high = difference_of(v)
    return [
        {
            "name": "Difference",
            "value": f"{apart}{response.unit}",
            "text": f"95 % {low} to {high}; {judged(v, response.unit)}, against the measurement",
            "good": v["equivalent"],
        }
    ]


def _diagnosed(verdict):
    return [
        {
            "name": "Diagnosis of the measurements",
            "value": verdict["verdict"],
            "text": " ".join(said_by_diagnosis(verdict)),
            "good": verdict["verdict"] == "adequate",
        }
    ]


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
