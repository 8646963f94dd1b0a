"""Tables 8 and 9, Eqs. 21 to 27: tilted plane, drop and direct shear."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import stats

from calibration.statistics.equivalence import Error
from paper.audit.bench import r_squared
from paper.audit.paper import TABLES, Paper, printed_number
from paper.reproduction import rows as r
from paper.reproduction.rows import Place
from paper.reproduction.study import Study

DRAWS = 2000
TRIALS = 5  # 2.3.2 and 2.3.3: the mean of five
UNPRINTED = (
    "The paper prints one yield locus and no scatter; it is taken to scatter as ours, of which the "
    "90 % interval is shown"
)


def rows(paper: Paper, study: Study) -> Iterator[dict[str, Any]]:
    """Rows of the bench tests."""
    for item in ("Table 8", "Table 9"):
        yield from _sweep(paper, study, item)
    yield from _shear(paper, study)


def _sweep(paper, study, item):
    sweep, stage = TABLES[item], TABLES[item].experiment
    equation, unit, factor = f"Eq. {sweep.equation[2:]}", sweep.unit, sweep.parameter
    runs, summary = study.table(stage, "runs"), study.summary(stage)
    if runs is None or summary is None:
        places = (Place(what, f"{stage}.{what}", f"{stage} test") for what in (item, equation))
        yield from (r.row(at, stage, agreement=r.NOT_RUN) for at in places)
        return

    levels, responses = sweep.points(paper)
    for level, text in zip(levels, paper.printed(sweep.file, sweep.column), strict=True):
        point = study.place(item, f"{stage}.{level:g}", f"{unit} at {factor} {level:g}", unit)
        here = runs[np.isclose(runs[factor], level)]
        if here.empty:
            yield r.row(point, "not a level of this sweep", text.text)
            continue
        run = here.iloc[0]
        sd = run.get("response_sd", math.nan)  # their mean of five trials scatters as ours
        sd, theirs = (None, None) if math.isnan(sd) else (sd, sd / math.sqrt(TRIALS))
        yield r.point(point, text, [run["response"]], sd, theirs, int(run.get("repeats", 1)))
    theirs, ours = _quadratic(levels, responses), _quadratic(runs[factor], runs["response"])

    def errors(of):
        return Error(of(ours), ours[2], len(runs)), Error(of(theirs), theirs[2])

    # of a coefficient, what moves the response by its own margin at the end of the range
    margin, half = r.by_unit(unit, float(responses.mean())), 0.5 * float(np.ptp(levels))
    for k, (name, printed) in enumerate(zip(("x²", "x", "1"), sweep.curve(paper), strict=True)):
        ident, words = f"{stage}.coefficient{k}", f"coefficient of {name}"
        own, other = errors(lambda fit, k=k: math.sqrt(fit[1][k, k]))
        of_power = margin / math.pow(half, 2 - k)
        coefficient = study.place(equation, ident, words, unit)
        yield r.estimates(coefficient, printed, float(ours[0][k]), own, other, of_power)
    printed = printed_number(paper.claims[f"{stage}.r2"].printed)
    statistic = study.place(equation, f"{stage}.R2", "R² of the quadratic")
    yield _r2(statistic, printed, runs[factor].to_numpy(float), runs["response"].to_numpy(float))
    level = summary["inverse"]
    inverse = study.place(equation, f"{stage}.inverse", r.said(factor), headline=True)
    own, other = errors(lambda fit: _inverse_se(fit, level))
    yield r.estimates(inverse, paper.scalar(factor), level, own, other)
    text = f"mean of runs at the inverse [{unit}]"
    confirmed = study.place(equation, f"{stage}.confirmation", text, unit)
    mean, sd, count = (summary.get(f"confirmed_{of}") for of in ("mean", "sd", "n"))
    yield r.means(confirmed, paper.scalar(sweep.confirmed), mean, sd, count, paper_n=TRIALS)


def _quadratic(x, y):
    """(coefficients, highest power first; their covariance; degrees of freedom) by least
    squares."""
    matrix, y = np.vander(np.asarray(x, float), 3), np.asarray(y, float)
    coefficients, *_ = np.linalg.lstsq(matrix, y, rcond=None)
    left, freedom = y - matrix @ coefficients, len(y) - 3
    return coefficients, float(left @ left) / freedom * np.linalg.inv(matrix.T @ matrix), freedom


def _inverse_se(fit, level):
    """Standard error of an inverse at `level`: that of the fitted curve there over its slope."""
    coefficients, covariance, _ = fit
    powers = np.array([level**2, level, 1.0])
    slope = float(np.polyval(np.polyder(coefficients), level))
    return math.sqrt(powers @ covariance @ powers) / abs(slope)


def _r2(place, printed, x, y):
    """R2 of our quadratic, its interval drawn from the fit and the scatter about it."""
    matrix = np.vander(x, 3)
    coefficients, _, freedom = _quadratic(x, y)
    fitted = matrix @ coefficients
    sd = math.sqrt(float(((y - fitted) ** 2).sum()) / freedom)
    draws = fitted + np.random.default_rng(1).normal(0.0, sd, (DRAWS, len(y)))
    hat = matrix @ np.linalg.pinv(matrix)
    residual = ((draws - draws @ hat.T) ** 2).sum(1)
    total = ((draws - draws.mean(1, keepdims=True)) ** 2).sum(1)
    ours, basis = r_squared(y, fitted), "90 % interval of our R², drawn from the fit"
    reach = r.reach(1 - residual / total, ours)
    return r.within(place, printed, ours, reach, basis, r.R2_MARGIN, len(y))


def _shear(paper, study):
    summary = study.summary("shear")
    if summary is None or "loci" not in summary:
        places = (Place(what, f"shear.{what}", "yield locus") for what in ("Eq. 26", "Eq. 27"))
        yield from (r.row(at, "shear", agreement=r.NOT_RUN) for at in places)
        return
    found, runs = summary[summary["measure"]], study.table("shear", "runs")

    def row(item, name, text, unit, scalar, value, interval, basis=UNPRINTED, margin=None):
        place = study.place(item, f"shear.{name}", text, unit, name != "intercept")
        reach = _reach(value, interval)
        printed = paper.scalar(scalar)
        return r.within(place, printed, value, reach, basis, margin, len(runs), reach)

    friction = found["particle_friction"]
    text = f"slope of the yield locus at particle friction {friction:g}"
    slope, interval = found["slope"], found["slope_interval"]
    yield row("Eq. 26", "slope", text, "1", "yield_locus_slope", slope, interval)
    nearest = min(summary["loci"], key=lambda locus: abs(locus["particle_friction"] - friction))
    locus = nearest[summary["measure"]]
    # an intercept is a part of the shear stress of the paper's locus at the mean load of our runs
    load = float(runs["normal_stress_kPa"].mean())
    stress = paper.value("yield_locus_slope") * load + paper.value("yield_locus_intercept")
    yield row(
        "Eq. 26", "intercept", "intercept of the yield locus", "kPa", "yield_locus_intercept",
        locus["intercept_kPa"], locus["intercept_interval_kPa"], margin=r.SHARE * stress,
    )  # fmt: skip
    text, scalar = "particle friction for the measured slope", "salt_salt_static_friction"
    if found["inverse"] is None:
        place = study.place("Eq. 27", "shear.friction", text, headline=True)
        none = "none between {:g} and {:g}".format(*found["swept"])
        yield r.words(place, paper.scalar_text(scalar), none, summary["sentence"])
    else:
        inverse, interval = found["inverse"], found["inverse_interval"]
        basis = f"{summary['sentence']} {UNPRINTED}"
        yield row("Eq. 27", "friction", text, "1", scalar, inverse, interval, basis)


def _reach(value, interval):
    """(below, above) of the 90 % interval of a value whose 95 % interval is given, as of a normal
    one."""
    share = float(stats.norm.ppf(0.95) / stats.norm.ppf(0.975))
    return share * (value - interval[0]), share * (interval[1] - value)
