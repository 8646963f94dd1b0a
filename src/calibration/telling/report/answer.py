"""The answer, before anything else, as the page shows it: all of it from answer.json, with the
solution set of the surface beneath; and what the chain's runs say: what decides, and what to know
of them; and the page's profiler: the response surfaces with their covariance, for the page to
evaluate; and the answer as a workbook: the parameters, intervals and how to cite them."""

import io
import json
import re
import zipfile
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any

import scipy

from calibration.chain.study import Results
from calibration.errors import CalibrationError
from calibration.figures import PLACES, Response, label
from calibration.statistics.surface import fit_surface
from calibration.telling.answer import words
from calibration.telling.answer.schema import answer_of
from calibration.telling.answer.words import given_nowhere, said
from dem.advice import limits_of
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.spec import load_spec
from dem.units import unit_of, without_unit


def answer(study: Path, response: Response) -> dict[str, Any] | None:
    """Mapping for the page, None where the stage `answer` has not run: `first` (each calibrated
    parameter in brief), `tests` (rows of every measured value), `by`, `wrong`, `right` (whether
    nothing is), `beside`, `next`, `block` (rows of every parameter), `solution` (rows of the
    surface's) and `notes`."""
    results = Results(study)
    answered = answer_of(results)
    if answered is None:
        return None
    optimum = results.summary("optimise", "optimum")
    time_step, limits = _of_spec(study / "exports" / "dem.yaml")
    return {
        "by": "all tests together" if answered.by == "joint" else f"the {response.name} alone",
        "first": [
            {"name": p.name, "value": words.value(p), "known": words.known(p)}
            for p in answered.parameters
            if p.source == "calibrated"
        ],
        "tests": [words.compared(t) | {"state": t.state} for t in answered.tests],
        "wrong": answered.wrong.sentence,
        "right": answered.wrong.verdict in ("met", "adequate") and predicts(results),
        "beside": [words.beside(b) for b in answered.beside],
        "next": " ".join(said("next", answered.next)) if answered.next else "",
        "block": [*_block(answered), *time_step],
        "solution": _solution(results, optimum) if optimum and answered.by == "chain" else [],
        "notes": [*(said("optimum", optimum, response) if optimum else []), *limits],
    }


def _block(answered):
    """Rows {heading: text} of every parameter, those of the contacts first."""
    rows = []
    for place, where in PLACES.items():
        for p in (p for p in answered.parameters if p.key.startswith(f"{place}.")):
            name, known = label(without_unit(p.key.rpartition(".")[2])), words.known(p)
            known = known if known == p.source else f"{p.source}; {known}"
            rows.append(_row(where, name, words.number(p), p.unit, known))
    return rows


def _row(*texts):
    return dict(zip(("where", "parameter", "value", "unit", "how it is known"), texts, strict=True))


def _of_spec(path):
    """([row of the time step], sentences where the laws make the result hold, and where not) of the
    calibrated run spec among the exports."""
    from dem.experiments.setup import time_step_of  # loads the engine

    try:
        spec = load_spec(path)
    except DemError:
        return [], []
    fraction = f"{spec.numerics.rayleigh_fraction:g} of the Rayleigh time of the smallest grain"
    row = _row("simulator", "time step", f"{time_step_of(spec):.4g}", "s", fraction)
    return [row], [f"{text}." for text in limits_of(spec)]


def _solution(results, optimum):
    """Rows {heading: text} of the calibrated parameters over the surface's solution set."""
    region = results.summary("response_surface", "region") or []
    units = {f["name"]: f" [{unit}]" for f in region if (unit := unit_of(f["key"]))}
    return [
        {
            "parameter": f"{label(name)}{units.get(name, '')}",
            "over the solution set": f"{low:.4g} to {high:.4g}",
        }
        for name, (low, high) in optimum["solution_set"].items()
        if not given_nowhere(optimum)
    ]


POOR = 0.5  # predicted R2 below which a surface predicts little


def predicts(results: Results) -> bool:
    """Return whether the response surface of a folder's `Results` predicts more than little; true
    where it has none, or no measure of it."""
    surface = results.summary("response_surface", "response_surface") or {}
    predicted = surface.get("statistics", {}).get("R2_pred")
    return predicted is None or predicted >= POOR


def findings(study: Path, response: Response) -> list[tuple[str, str]]:
    """[(heading, text)] for the page's first screen; only what the study's files hold."""
    results, found = Results(study), []
    screening, effects = results.summary("screening"), results.table("screening", "effects")
    if screening and effects is not None:
        rows = effects.sort_values("effect", key=abs, ascending=False).to_dict("records")
        found.append(("What decides", " ".join(said("decides", rows, screening, response))))
    odd = _left_out(screening, response) if screening else []
    if surface := results.summary("response_surface"):
        odd += said("surface", surface, POOR)
    if odd:
        found.append(("What to know of the runs", " ".join(odd)))
    return found


def _left_out(screening, response):
    """A sentence on the largest effect that was left out, where others went on that are smaller."""
    effects, on = screening.get("effects", {}), screening["factors"]
    largest = max((n for n in effects if n not in on), key=lambda n: abs(effects[n]), default=None)
    smaller = [n for n in on if n in effects and abs(effects[n]) < abs(effects.get(largest, 0.0))]
    why = screening.get("why", {})
    reasons = dict.fromkeys(why.get(n, "the configured path prefers it") for n in smaller)
    return said("left_out", screening, largest, smaller, reasons, response) if smaller else []


def profiler(study: Path, response: Response) -> str | None:
    """JSON of the factors and the response, or None where no surface was fitted.

    The response has terms, coefficients and their covariance. The surface is the stage's own, of
    the runs in its table; the optimum's has more runs.
    """
    results = Results(study)
    region, runs = results.summary("response_surface", "region"), None
    if region and (optimum := results.summary("optimise", "optimum")):
        runs = results.table("response_surface", "runs")
    if runs is None:
        return None
    codes = [f["code"] for f in region]
    runs = runs.dropna(subset=["response"])
    try:
        surface = fit_surface(runs, codes, runs["response"])
    except CalibrationError:
        return None
    factors = [
        {"name": escape(label(f["name"]))}
        | {k: f[k] for k in ("key", "low", "high")}
        | {"value": optimum["optimum"][f["name"]]}
        for f in region
    ]
    fitted = {
        "terms": [[codes.index(c) for c in term] for term in surface.terms],
        "beta": [float(b) for b in surface.beta],
        "covariance": (surface.sigma2 * surface.inverse).tolist(),
        "t": float(scipy.stats.t.ppf(0.975, surface.df)) if surface.df > 0 else None,
        "target": optimum["target"],
        "unit": response.unit,
        "name": response.name,
    }
    data = json.dumps({"factors": factors, "response": fitted})
    return data.replace("<", "\\u003c")  # nothing in a name ends the script


PACKAGE = "granular-calibration"
WRITTEN = (1980, 1, 1, 0, 0, 0)
"""Time of a file within these: the same study makes the same bytes."""


def citation(name: str) -> str:
    """How to cite a study's answer: the program, its version and that of its engine."""
    return (
        f"Cite as: the granular-calibration developers, {PACKAGE} {version(PACKAGE)} "
        f"(engine {engine_fingerprint()}), study “{name}”."
    )


def workbook(name: str, told: Mapping[str, Any], found: Sequence[tuple[str, str]]) -> bytes:
    """A workbook: a sheet of every parameter, one of every measured value, one of words; told: the
    `answer`; found: the `findings`. Values that are numbers stand as numbers."""
    import openpyxl  # takes a quarter of a second

    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, table in (("parameters", told["block"]), ("tests", told["tests"])):
        if table:
            _table_sheet(book.create_sheet(title), table)
    words = book.create_sheet("words")
    for row in told["first"]:
        words.append([row["name"], f"{row['value']}: {row['known']}"])
    words.append(["What is wrong", told["wrong"]])
    if told["next"]:
        words.append(["What to measure next", told["next"]])
    for line in (*found, ("", citation(name))):
        words.append(list(line))
    words.column_dimensions["A"].width, words.column_dimensions["B"].width = 30, 100
    kept = io.BytesIO()
    book.save(kept)
    return _at_one_time(kept.getvalue())


def _table_sheet(sheet, table):
    from openpyxl.styles import Font

    sheet.append(list(table[0]))
    for row in table:
        sheet.append([_as_number(text) for text in row.values()])
    for cell in sheet[1]:
        cell.font = Font(bold=True)
        sheet.column_dimensions[cell.column_letter].width = 30


def _as_number(text):
    try:
        return float(text)
    except ValueError:
        return text


def _at_one_time(package):
    """The same package with one time in it, in place of that of its making."""
    kept = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(package)) as old, zipfile.ZipFile(kept, "w") as new:
        for entry in old.namelist():
            text = old.read(entry)
            if entry == "docProps/core.xml":
                text = re.sub(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", b"1980-01-01T00:00:00Z", text)
            new.writestr(zipfile.ZipInfo(entry, WRITTEN), text, zipfile.ZIP_DEFLATED)
    return kept.getvalue()
