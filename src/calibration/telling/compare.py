"""Two studies side by side: parameters with their intervals, screening, surface, validation and
cost, as a table in Markdown."""

from collections.abc import Iterator
from math import hypot
from pathlib import Path

from calibration.chain.study import Results
from calibration.chain.validation import verdict_of
from calibration.errors import CalibrationError
from calibration.figures import label
from calibration.intake.tables import read_written
from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDED
from calibration.statistics.numbers import difference_of, fixed, signed
from calibration.study.stages import load_stages
from calibration.telling.report.answer import intervals
from calibration.telling.report.runs import run_times

NONE = "-"
IN_A_CELL = {EQUIVALENT: "yes", DIFFERENT: "no", UNDECIDED: "not shown"}
FITTED = (("R2", "R²", 3), ("R2_pred", "predicted R²", 3), ("CV_percent", "CV [%]", 2))
"""(key of the surface's statistics, words, decimals)."""
Row = tuple[str, ...]


def compare(first: Path, second: Path) -> str:
    """Markdown of two folders of results, stage by stage what both or one of them found.

    Raises CalibrationError where a folder has no calibrated point."""
    studies = [_results(path) for path in (first, second)]
    names = [s.name for s in studies]
    if names[0] == names[1]:
        names = [str(path) for path in (first, second)]
    parts = [
        ("Parameters", _parameters(*studies)),
        ("Effects in the screening", _effects(*studies)),
        ("Response surface", _surface(*studies)),
        ("Validation", _validation(*studies)),
        ("Cost", _cost(*studies)),
    ]
    text = [f"# {names[0]} and {names[1]}"]
    for title, rows in parts:
        lines = [f"| {' | '.join(row)} |" for row in rows]
        head = [f"## {title}", "", f"|  | {names[0]} | {names[1]} |", "|---|---|---|"]
        text.append("\n".join([*head, *lines]))
    return "\n\n".join(text) + "\n"


def _results(path):
    found = Results(path)
    if found.summary("optimise", "optimum") is None:
        raise CalibrationError(
            f"{path}: has no calibrated point; allowed: a folder of results, such as results/salt, "
            "whose study has run as far as `optimise`"
        )
    return found


def _parameters(first: Results, second: Results) -> Iterator[Row]:
    """Value and interval of each parameter; of two posteriors how far their means are apart, in
    their joint standard deviation."""
    values = [s.summary("optimise", "optimum")["optimum"] for s in (first, second)]
    words = [intervals(s) for s in (first, second)]
    for name in _all(*values):
        cells = [_cell(v, w, name) for v, w in zip(values, words, strict=True)]
        yield (label(name), *cells)
    for name, apart in _apart(first, second):
        yield f"{label(name)}: means apart, in standard deviations", f"{apart:.1f}", ""


def _cell(values, words, name):
    if name not in values:
        return NONE
    return f"{values[name]:.4g}" + (f"; 95 %: {words[name]}" if words.get(name) else "")


def _all(first, second):
    """Keys of two mappings, each once, those of the first in front."""
    return list(dict.fromkeys([*first, *second]))


def _apart(first, second):
    found = [(s.summary("posterior") or {}).get("parameters", {}) for s in (first, second)]
    for name in found[0]:
        if name in found[1]:
            a, b = (f[name] for f in found)
            yield name, abs(a["mean"] - b["mean"]) / hypot(a["sd"], b["sd"])


def _effects(first: Results, second: Results) -> Iterator[Row]:
    """Effect of each factor, with its p."""
    tables = [s.table("screening", "effects") for s in (first, second)]
    found = [{} if t is None else t.set_index("name")[["effect", "p"]].T.to_dict() for t in tables]
    for name in _all(*found):
        cells = [
            f"{signed(f[name]['effect'])} (p = {f[name]['p']:.2g})" if name in f else NONE
            for f in found
        ]
        yield (label(name), *cells)


def _surface(first: Results, second: Results) -> Iterator[Row]:
    found = [s.summary("response_surface") or {} for s in (first, second)]
    yield ("equation, coded", *(f.get("equation_coded", NONE) for f in found))
    for key, words, digits in FITTED:
        values = [f.get("statistics", {}).get(key) for f in found]
        yield (words, *(NONE if v is None else fixed(v, digits) for v in values))


def _validation(first: Results, second: Results) -> Iterator[Row]:
    found = [s.summary("validation") for s in (first, second)]

    def cells(form):
        return [NONE if v is None else form(v) for v in found]

    yield ("measured", *cells(lambda v: f"{v['measured_mean']:.4g}"))
    yield ("simulated", *cells(lambda v: f"{v['simulated_mean']:.4g} (sd {v['simulated_sd']:.2g})"))
    yield ("difference, 95 %", *cells(lambda v: "{} ({} to {})".format(*difference_of(v))))
    yield (
        "equivalent",
        *cells(lambda v: f"{IN_A_CELL[verdict_of(v)]}, within ±{v['margin']:g}"),
    )


def _cost(first: Results, second: Results) -> Iterator[Row]:
    """Different runs of the tables, and their time on one core where the runs are at hand."""
    yield ("runs", *(str(len(_runs(s.folder))) for s in (first, second)))
    tables = [run_times(s.folder, load_stages()) for s in (first, second)]
    times = [t.drop_duplicates("run_id")["wall_time_s"].sum() if len(t) else None for t in tables]
    yield ("time of one core [min]", *(NONE if t is None else f"{t / 60.0:.3g}" for t in times))


def _runs(folder):
    found = (read_written(path) for path in sorted(folder.glob("*/runs.csv")))
    return {name for table in found if "run_id" in table for name in table["run_id"]}
