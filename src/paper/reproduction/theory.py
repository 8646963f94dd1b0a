"""Eqs. 1 to 15: definitions, identities checked with numbers, and the statements that the scaling
study judged."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from calibration.statistics.equivalence import DIFFERENT, EQUIVALENT, UNDECIDED, Error
from paper.reproduction import margins
from paper.reproduction.rows import (
    ARITHMETIC,
    ENGINE,
    NO_NUMBER,
    NOT_RUN,
    Place,
    absent,
    estimates,
    printed_of,
)

if TYPE_CHECKING:
    from paper.audit.paper import Paper
    from paper.reproduction.study import Study


VERDICTS = {"holds": EQUIVALENT, "fails": DIFFERENT, "undecided": UNDECIDED}


def effective_mass(radius: float, density: float, ratio: float) -> tuple[float, float]:
    """Eq. 10 and the effective mass of two spheres of radii R and ratio R [kg]. radius [m], density
    [kg/m3]."""
    sphere = 4.0 / 3.0 * math.pi * density * radius**3
    other = sphere * ratio**3
    printed = 4.0 * math.pi * radius**3 * density * ratio**3 / (3.0 * (1.0 + ratio**3))
    return printed, sphere * other / (sphere + other)


def effective_radius(radius: float, density: float, ratio: float) -> tuple[float, float]:
    """Eq. 11's right side and its left side [m]."""
    return radius * ratio / (1.0 + ratio), radius * ratio * radius / (radius + ratio * radius)


def dimensionless_contact(
    radius: float, density: float, ratio: float
) -> tuple[np.ndarray, np.ndarray]:
    """Inertia, stiffness and damping terms of Eq. 14, from Eq. 9 with Eq. 12 put in, over R^2 rho
    v0^2. radius [m], density [kg/m3]; both results (3,)."""
    stiffness, damping, speed = 800.0, 0.01, 1.7
    mass = effective_mass(radius, density, ratio)[1]
    terms = np.array([mass * speed**2 / radius, stiffness * radius, damping * speed])
    printed = np.array(
        [
            4.0 * math.pi * ratio**3 / (3.0 * (1.0 + ratio**3)),
            stiffness / (radius * density * speed**2),
            damping / (radius**2 * density * speed),
        ]
    )
    return printed, terms / (radius**2 * density * speed**2)


IDENTITIES = {f.__name__: f for f in (effective_mass, effective_radius, dimensionless_contact)}


CLAIMS = "config/claims.yaml makes these runs; results/reference/salt has a release's"
ENLARGED = "The angle of repose does not change with the scale"


def rows(paper: Paper, study: Study) -> Iterator[dict[str, Any]]:
    """A row an equation or statement; equations that hold a table's numbers stand with that
    table."""
    summary = study.summary("scaling")
    statements = {s["id"]: s for s in summary["statements"]} if summary else {}
    table = paper.text("equations", "equation", "shows", "kind", "here")
    for number, shows, kind, here in table.itertuples(index=False):
        item = f"Eq. {number}"
        if kind == "definition":
            yield absent(
                Place(item, f"eq{number}", shows, evidence=ARITHMETIC), None, NO_NUMBER, here
            )
        elif kind == "identity":
            yield _identity(Place(item, f"eq{number}", shows, evidence=ARITHMETIC), here)
        elif kind == "statement":
            for name in here.split():
                yield _statement(item, name, statements.get(name), study.name)
    if summary is None:
        place = Place("1.2", "heap.paper.plain.twice", ENLARGED, "deg", study.name)
        yield absent(place, "0.0", NOT_RUN, CLAIMS)
    responses = study.table("scaling", "scaling")
    for name, statement in statements.items():
        if name.split(".")[0] in ("heap", "drop"):
            yield from _over_scales(name, statement, responses, study.name)


def _identity(place, name):
    """Both sides of an equation at size ratios 0.5 to 4."""
    sides = [IDENTITIES[name](1e-3, 1210.0, ratio) for ratio in (0.5, 1.0, 2.0, 4.0)]
    same = all(np.allclose(a, b, rtol=1e-12) for a, b in sides)
    return absent(
        place, "=", EQUIVALENT if same else DIFFERENT,
        "both sides computed at size ratios 0.5 to 4",
        "equal" if same else "not equal",
    )  # fmt: skip


def _statement(item, name, statement, study):
    if statement is None:
        return absent(Place(item, name, name), None, NOT_RUN, CLAIMS)
    evidence = ARITHMETIC if name.startswith("eq") else ENGINE
    place = Place(item, name, statement["statement"], "1", study, False, evidence)
    row = absent(place, None, VERDICTS[statement["verdict"]], statement["sentence"])
    printed, found = statement["printed"], statement["found"]
    if found is not None:
        low, high = statement["low"] - printed, statement["high"] - printed
        row |= {"paper": f"{printed:g}", "this_project": found, "difference": found - printed}
        row |= {"low": low, "high": high}
    return row


TWICE = 2.0
"""The enlargement that the paper made (1.2.2): salt of 1 mm as grains of 2 mm."""


def _over_scales(name, statement, responses, study):
    """Rows of a quantity that is said not to change with the scale: when grain and rig are doubled,
    and over the whole range of scales; responses: the table of the scaling study."""
    experiment, rule, kind = name.split(".")
    case = responses[
        (responses["experiment"] == experiment)
        & (responses["rule"] == rule)
        & (responses["cohesive"] == (kind == "cohesive"))
    ]
    unit, digits, none = ("deg", 2, "0.0") if experiment == "heap" else ("1", 4, "0.000")
    margin = margins.SCALING[experiment]
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
