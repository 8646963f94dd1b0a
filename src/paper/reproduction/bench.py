"""Tables 8 and 9, Eqs. 21 to 27: tilted plane, drop and direct shear."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from calibration.statistics.equivalence import Error
from paper.reproduction import margins
from paper.reproduction.rows import (
    NOT_COMPARABLE,
    NOT_RUN,
    Place,
    absent,
    estimates,
    line_fit,
    means,
    point,
    printed_of,
    said,
    within,
    words,
)

if TYPE_CHECKING:
    from paper.audit.paper import Paper
    from paper.reproduction.study import Study


DRAWS = 2000
TESTS = {
    # stage: table, file, column, equation, unit; scalars: factor, confirming mean, coefficients
    "tilt": (
        "Table 8", "table08_inclined_plane", "angle_deg", "Eq. 21", "deg",
        "salt_steel_static_friction", "simulated_tilt_angle", "eq21_coefficients",
    ),
    "drop": (
        "Table 9", "table09_drop_test", "rebound_height_mm", "Eq. 23", "mm",
        "salt_steel_restitution", "simulated_rebound_at_0.421", "eq23_coefficients",
    ),
}  # fmt: skip
R2 = {"tilt": "tilt.r2", "drop": "drop.r2"}
TRIALS = 5  # 2.3.2 and 2.3.3: the mean of five


def rows(paper: Paper, study: Study) -> Iterator[dict[str, Any]]:
    """Rows of the bench tests."""
    for stage in TESTS:
        yield from _sweep(paper, study, stage)
    yield from _shear(paper, study)


def _sweep(paper, study, stage):
    item, file, column, equation, unit, factor, confirming, coefficients = TESTS[stage]
    runs, summary = study.table(stage, "runs"), study.summary(stage)
    if runs is None or summary is None:
        for what in (item, equation):
            yield absent(Place(what, f"{stage}.{what}", f"{stage} test"), None, NOT_RUN, stage)
        return
    table = paper.numbers(file, factor, column)
    for level, text in zip(table[factor], paper.printed(file, column), strict=True):
        place = Place(item, f"{stage}.{level:g}", f"{unit} at {factor} {level:g}", unit, study.name)
        here = runs[np.isclose(runs[factor], level)]
        if here.empty:
            yield absent(place, text.text, NOT_COMPARABLE, "not a level of this sweep")
            continue
        run = here.iloc[0]
        repeats = int(run.get("repeats", 1))
        yield _point(place, text, run["response"], run.get("response_sd"), repeats)
    theirs = _quadratic(table[factor], table[column])
    ours = _quadratic(runs[factor], runs["response"])
    printed = paper.scalar_text(coefficients).split()
    for k, (name, text) in enumerate(zip(("x²", "x", "1"), printed, strict=True)):
        place = Place(
            equation, f"{stage}.coefficient{k}", f"coefficient of {name}", unit, study.name
        )
        mine, their_se = float(ours[0][k]), math.sqrt(theirs[1][k, k])
        response = margins.by_unit(unit, float(table[column].mean()))
        margin = margins.of_coefficient(response, list(table[factor]), 2 - k)
        own = Error(math.sqrt(ours[1][k, k]), ours[2], len(runs))
        yield estimates(place, printed_of(text), mine, own, Error(their_se, theirs[2]), margin)
    place = Place(equation, f"{stage}.R2", "R² of the quadratic", "1", study.name)
    yield _r2(place, printed_of(paper.claims[R2[stage]].printed), runs[factor], runs["response"])
    place = Place(equation, f"{stage}.inverse", said(factor), "1", study.name, headline=True)
    level = summary["inverse"]
    own, their_own = (_inverse_se(fit, level) for fit in (ours, theirs))
    own = Error(own, ours[2], len(runs))
    yield estimates(place, paper.scalar(factor), level, own, Error(their_own, theirs[2]))
    place = Place(
        equation, f"{stage}.confirmation", f"mean of runs at the inverse [{unit}]", unit, study.name
    )
    mean, sd = summary["confirmed_mean"], summary["confirmed_sd"]
    count = summary.get("confirmed_n")
    yield means(place, paper.scalar(confirming), mean, sd, count, paper_n=TRIALS)


def _point(place, text, response, sd, repeats):
    """A point of a sweep: our mean of so many repeats beside the paper's mean of five trials, taken
    to scatter as ours."""
    if sd is None or math.isnan(sd):
        return point(place, text, response, None, repeats)
    return point(place, text, response, sd, repeats, sd / math.sqrt(TRIALS))


def _quadratic(x, y):
    """(coefficients, highest power first; their covariance; degrees of freedom)."""
    return line_fit(np.vander(np.asarray(x, float), 3), np.asarray(y, float))


def _inverse_se(fit, level):
    """Standard error of an inverse at `level`: that of the fitted curve there over its slope."""
    coefficients, covariance, _ = fit
    powers = np.array([level**2, level, 1.0])
    slope = float(np.polyval(np.polyder(coefficients), level))
    return math.sqrt(powers @ covariance @ powers) / abs(slope)


def _r2(place, printed, x, y):
    """R2 of our quadratic, its interval drawn from the fit and the scatter about it."""
    matrix = np.vander(np.asarray(x, float), 3)
    y = np.asarray(y, float)
    coefficients, _, freedom = line_fit(matrix, y)
    fitted = matrix @ coefficients
    sd = math.sqrt(float(((y - fitted) ** 2).sum()) / freedom)
    draws = fitted + np.random.default_rng(1).normal(0.0, sd, (DRAWS, len(y)))
    hat = matrix @ np.linalg.pinv(matrix)
    residual = ((draws - draws @ hat.T) ** 2).sum(1)
    total = ((draws - draws.mean(1, keepdims=True)) ** 2).sum(1)
    low, high = np.quantile(1 - residual / total, (0.05, 0.95))
    ours = 1 - float(((y - fitted) ** 2).sum() / ((y - y.mean()) ** 2).sum())
    basis = "90 % interval of our R², drawn from the fit"
    return within(place, printed, ours, (ours - low, high - ours), basis, margins.R2, len(y))


def _shear(paper, study):
    summary = study.summary("shear")
    if summary is None or "loci" not in summary:
        for item in ("Eq. 26", "Eq. 27"):
            yield absent(Place(item, f"shear.{item}", "yield locus"), None, NOT_RUN, "shear")
        return
    found = summary[summary["measure"]]
    friction = paper.scalar("salt_salt_static_friction")
    text = f"slope of the yield locus at particle friction {found['particle_friction']:g}"
    place = Place("Eq. 26", "shear.slope", text, "1", study.name, headline=True)
    reach = _reach(found["slope"], found["slope_interval"])
    runs = len(study.table("shear", "runs"))
    yield within(
        place, paper.scalar("yield_locus_slope"), found["slope"], reach, UNPRINTED, runs=runs,
        paper_reach=reach
    )  # fmt: skip
    nearest = min(
        summary["loci"], key=lambda x: abs(x["particle_friction"] - found["particle_friction"])
    )
    locus = nearest[summary["measure"]]
    place = Place("Eq. 26", "shear.intercept", "intercept of the yield locus", "kPa", study.name)
    reach = _reach(locus["intercept_kPa"], locus["intercept_interval_kPa"])
    yield within(
        place, paper.scalar("yield_locus_intercept"), locus["intercept_kPa"], reach, UNPRINTED,
        margins.SHARE * _shear_stress(paper, study), runs, reach,
    )  # fmt: skip
    place = Place(
        "Eq. 27", "shear.friction", "particle friction for the measured slope", "1", study.name,
        headline=True
    )  # fmt: skip
    if found["inverse"] is None:
        low, high = found["swept"]
        yield words(place, friction.text, f"none between {low:g} and {high:g}", summary["sentence"])
    else:
        reach = _reach(found["inverse"], found["inverse_interval"])
        yield within(
            place, friction, found["inverse"], reach, f"{summary['sentence']} {UNPRINTED}",
            runs=runs, paper_reach=reach
        )  # fmt: skip


UNPRINTED = (
    "The paper prints one yield locus and no scatter; it is taken to scatter as ours, of which the "
    "90 % interval is shown"
)


def _reach(value, interval):
    """(below, above) of the 90 % interval of a value whose 95 % interval is given, as of a normal
    one."""
    share = float(stats.norm.ppf(0.95) / stats.norm.ppf(0.975))
    return share * (value - interval[0]), share * (interval[1] - value)


def _shear_stress(paper, study):
    """Shear stress [kPa] of the paper's yield locus at the mean load of our runs, of which an
    intercept is a part."""
    load = float(study.table("shear", "runs")["normal_stress_kPa"].mean())
    return paper.value("yield_locus_slope") * load + paper.value("yield_locus_intercept")
