"""Data of the page's profiler: the response surfaces with their covariance, so that the page itself
can evaluate them."""

import json
from html import escape
from pathlib import Path

import scipy

from calibration.chain.study import Results
from calibration.errors import CalibrationError
from calibration.figures import Response, label, response_of
from calibration.intake.tables import read_written
from calibration.statistics.surface import fit_surface


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
