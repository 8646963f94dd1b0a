"""Data of the page's profiler: the response surface with its covariance, so that the page itself
can evaluate it."""

import json
from html import escape

from scipy import stats

from calibration.errors import CalibrationError
from calibration.figures import label
from calibration.statistics.surface import fit_surface
from calibration.study import Results
from calibration.tables import read_written


def profiler(study, response):
    """JSON of factors, terms, coefficients and their covariance, or None where no surface was
    fitted.

    The surface is the stage's own, of the runs in its table; the optimum's has more runs.
    """
    region = Results(study).summary("response_surface", "region")
    optimum = Results(study).summary("optimise", "optimum")
    path = study / "response_surface" / "runs.csv"
    if not (region and optimum and path.exists()):
        return None
    runs, codes = read_written(path), [f["code"] for f in region]
    if "response" not in runs or not set(codes) <= set(runs):
        return None
    try:
        surface = fit_surface(runs.dropna(subset=["response"]), codes, runs["response"].dropna())
    except CalibrationError:
        return None
    place = {code: k for k, code in enumerate(codes)}
    text = json.dumps(
        {
            "factors": [
                {
                    "name": escape(label(f["name"])),
                    "key": f["key"],
                    "low": f["low"],
                    "high": f["high"],
                    "value": optimum["optimum"].get(f["name"], 0.5 * (f["low"] + f["high"])),
                }
                for f in region
            ],
            "terms": [[place[c] for c in term] for term in surface.terms],
            "beta": [float(b) for b in surface.beta],
            "covariance": (surface.sigma2 * surface.inverse).tolist(),
            "t": float(stats.t.ppf(0.975, surface.df)) if surface.df > 0 else None,
            "target": optimum["target"],
            "unit": response.unit,
            "name": response.name,
        }
    )
    return text.replace("<", "\\u003c")  # nothing in a name ends the script
