"""Section 1.2: the statements that the scaling study judged by runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from scipy import stats

from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDED, Error
from paper.reproduction.rows import (
    NO_NUMBER,
    NOT_RUN,
    SCALING,
    Place,
    absent,
    estimates,
    printed_of,
)

if TYPE_CHECKING:
    from paper.reproduction.study import Study


VERDICTS = {"holds": EQUIVALENT, "fails": DIFFERENT, "undecided": UNDECIDED}
CLAIMS = "config/reference.yaml makes these runs; results/reference/salt has a release's"
ENLARGED = "The angle of repose does not change with the scale"
TWICE = 2.0
"""The enlargement that the paper made (1.2.2): salt of 1 mm as grains of 2 mm."""


def rows(study: Study) -> Iterator[dict[str, Any]]:
    """A row a statement. What dimensions decide alone is in the audit."""
    summary = study.summary("scaling")
    if summary is None:
        place = Place("1.2", "heap.paper.plain.twice", ENLARGED, "deg", study.name)
        yield absent(place, "0.0", NOT_RUN, CLAIMS)
        return
    responses = study.table("scaling", "scaling")
    for statement in summary["statements"]:
        kind = statement["id"].split(".")[0]
        if kind == "section122":
            yield _statement(statement, study.name)
        elif kind in ("heap", "drop"):
            yield from _over_scales(statement, responses, study.name)


def _statement(statement, study):
    place = Place("Eq. 15", statement["id"], statement["statement"], "1", study)
    row = absent(place, None, VERDICTS[statement["verdict"]], statement["sentence"])
    printed, found = statement["printed"], statement["found"]
    if found is not None:
        low, high = statement["low"] - printed, statement["high"] - printed
        row |= {"paper": f"{printed:g}", "this_project": found, "difference": found - printed}
        row |= {"low": low, "high": high}
    return row


def _over_scales(statement, responses, study):
    """Rows of a quantity that is said not to change with the scale: when grain and rig are doubled,
    and over the whole range of scales; responses: the table of the scaling study."""
    name = statement["id"]
    experiment, rule, kind = name.split(".")
    case = responses[
        (responses["experiment"] == experiment)
        & (responses["rule"] == rule)
        & (responses["cohesive"] == (kind == "cohesive"))
    ]
    unit, digits, none = ("deg", 2, "0.0") if experiment == "heap" else ("1", 4, "0.000")
    margin = SCALING[experiment]
    runs = int(case["n"].sum())
    place = Place("1.2", name, f"{statement['statement']}, over the whole range", unit, study)
    if statement["found"] is None:
        yield absent(place, "0", NO_NUMBER, statement["sentence"])
    else:
        freedom = max(runs - 2, 1)
        reach = 0.5 * (statement["high"] - statement["low"])
        own = Error(reach / float(stats.t.ppf(0.975, freedom)), freedom, runs)
        row = estimates(place, printed_of(none), statement["found"], own, margin=margin)
        yield row | {"basis": statement["sentence"]}
    first, twice = (case[case["scale"] == h] for h in (case["scale"].min(), TWICE))
    if len(twice) and len(first) and min(twice["n"].iloc[0], first["n"].iloc[0]) > 1:
        text = f"{statement['statement']}, when doubled as the paper did"
        place = Place("1.2", f"{name}.twice", text, unit, study, experiment == "heap")
        yield _doubled(place, printed_of(none), first.iloc[0], twice.iloc[0], margin, digits)


def _doubled(place, none, first, twice, margin, digits):
    """Row of the change from the first scale to the second, by Welch's interval."""
    one, two = (Error(x["sd"] / math.sqrt(x["n"]), x["n"] - 1) for x in (first, twice))
    se, freedom = two.beside(one)
    own = Error(se, freedom, int(first["n"] + twice["n"]))
    row = estimates(place, none, twice["mean"] - first["mean"], own, margin=margin)
    ends = ", ".join(
        f"{x['mean']:.{digits}f} at scale {x['scale']:g} ({int(x['n'])} runs)"
        for x in (first, twice)
    )
    return row | {"basis": f"{ends}; Welch interval"}
