"""The scaling claim of 1.2 judged: angle of repose and rebound against scale, and each statement of
the paper.

A quantity that a rule keeps has the same value at every scale. A value is kept if the 95 % interval
of its difference lies within the margin that does not matter. It is changed if the interval leaves
out zero and part of it lies beyond the margin. Otherwise it is undecided.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike

from calibration import figures
from calibration.chain.scaling.dimensions import (
    GRAVITY_RULE,
    PAPER_RULE,
    RULES,
    OverdeterminedError,
    check_consistent,
    exponent,
    group_exponents,
    settings_of,
)
from calibration.chain.scaling.plan import base_run, enlarged
from calibration.chain.scaling.probe import measured_exponents
from calibration.errors import CalibrationError
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_metric, read_values
from calibration.statistics.numbers import fixed
from dem.io.files import write_json
from dem.units import in_ascii, unit_of

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.config import Config


RESPONSE = {"heap": "angle_of_repose_deg", "drop": "effective_restitution"}
HOLDS, FAILS, UNDECIDED = "holds", "fails", "undecided"
KEPT, CHANGED = "kept", "changed"
VERDICT = {KEPT: HOLDS, CHANGED: FAILS, UNDECIDED: UNDECIDED}
DIFFERENCE = ("difference", "difference_low", "difference_high")
EXACT = 0.01  # exponents measured on one contact carry rounding alone


@dataclass(frozen=True)
class Statement:
    """A statement of the paper, what the runs or the theory gave, and the verdict that follows."""

    id: str
    where: str
    statement: str
    printed: float | None
    found: float | None
    low: float | None
    high: float | None
    verdict: str
    sentence: str


def response_table(
    design: pd.DataFrame, metrics: np.ndarray, margins: Mapping[str, float], alpha: float = 0.05
) -> pd.DataFrame:
    """Table, a row a case and scale: mean, sd, interval, difference from the first scale with
    interval, change. n counts the runs with a value; what fewer than two tell is NaN.

    design : columns experiment, rule, cohesive, scale, left_in_funnel (grains, heaps only)
    metrics : (n,) response of each run, NaN without
    margins : {experiment: difference that does not matter}
    """
    runs, rows = design.assign(response=metrics), []
    for (experiment, rule, cohesive), case in runs.groupby(
        ["experiment", "rule", "cohesive"], sort=False
    ):
        first = case.loc[case["scale"] == case["scale"].iloc[0], "response"].dropna().to_numpy()
        for scale, group in case.groupby("scale", sort=False):
            values = group["response"].dropna().to_numpy()
            row = {"experiment": experiment, "rule": rule, "cohesive": bool(cohesive)}
            row |= {"scale": float(scale), "n": len(values)} | mean_interval(values, alpha)
            row |= {"unit": in_ascii(unit_of(RESPONSE[experiment]))}
            row |= {"left_in_funnel": group["left_in_funnel"].mean()}
            if scale != case["scale"].iloc[0]:
                row |= difference(first, values, margins[experiment], alpha)
            rows.append(row)
    return pd.DataFrame(rows)


def mean_interval(values: np.ndarray, alpha: float = 0.05) -> dict[str, float]:
    """Mean, sd and the interval of the mean of values (n,), as columns of `response_table`; NaN of
    fewer than two."""
    columns = "mean", "sd", "low", "high"
    if len(values) < 2:
        return dict.fromkeys(columns, np.nan)
    mean, quantile = values.mean(), scipy.stats.t.ppf(1 - alpha / 2, len(values) - 1)
    half = quantile * scipy.stats.sem(values)
    return dict(zip(columns, (mean, values.std(ddof=1), mean - half, mean + half), strict=True))


def difference(
    first: np.ndarray, values: np.ndarray, margin: float, alpha: float = 0.05
) -> dict[str, Any]:
    """Difference of the samples values (n,) and first (m,) with its Welch interval, and whether it
    is kept, changed or undecided, as columns of `response_table`. With fewer than two values in
    one of them it is undecided."""
    if min(len(first), len(values)) < 2:
        return dict.fromkeys(DIFFERENCE, np.nan) | {"change": UNDECIDED}
    apart = float(values.mean() - first.mean())
    if values.var() + first.var() == 0.0:  # runs without scatter differ exactly or not at all
        low = high = apart
    else:
        found = scipy.stats.ttest_ind(values, first, equal_var=False)
        low, high = found.confidence_interval(1 - alpha)
    change = judge(low, high, margin)
    return dict(zip(DIFFERENCE, (apart, low, high), strict=True)) | {"change": change}


def judge(low: float, high: float, margin: float) -> str:
    """Whether a change with the interval [low, high] is kept, changed or undecided."""
    if -margin <= low and high <= margin:
        return KEPT
    return CHANGED if low > 0.0 or high < 0.0 else UNDECIDED


def trend(scale: ArrayLike, response: ArrayLike, alpha: float = 0.05) -> tuple[float, float, float]:
    """(change, low, high) of the responses (n,) from the smallest to the largest scale (n,), by a
    line over log2 of the scale through all runs with a value; NaN with fewer than three of them, or
    none at one of both ends."""
    scale, has = np.asarray(scale, float), np.isfinite(response)
    if has.sum() < 3 or np.ptp(scale[has]) < np.ptp(scale):
        return np.nan, np.nan, np.nan
    scale, response = scale[has], np.asarray(response)[has]
    octaves = np.log2(scale)
    fit, span = scipy.stats.linregress(octaves, response), float(np.ptp(octaves))
    half = float(scipy.stats.t.ppf(1 - alpha / 2, len(octaves) - 2) * fit.stderr) * span
    change = float(fit.slope) * span
    return change, change - half, change + half


def response_statements(runs: pd.DataFrame, margins: Mapping[str, float]) -> list[Statement]:
    """A statement a case: does the response keep its value over the scales? One trend, so that one
    test judges it.

    runs : columns experiment, rule, cohesive, scale, response, NaN of a run without a value
    """
    out = []
    for (experiment, rule, cohesive), case in runs.groupby(
        ["experiment", "rule", "cohesive"], sort=False
    ):
        told = case.dropna(subset="response")
        found, low, high = trend(case["scale"], case["response"])
        change = judge(low, high, margins[experiment])
        what = {"heap": "angle of repose", "drop": "restitution on steel"}[experiment]
        how = "with cohesion" if cohesive else "without cohesion"
        unit, digits = {"heap": ("°", 1), "drop": ("", 3)}[experiment]
        means = [
            f"{values.mean():.{digits}f}{unit} at scale {h:g}"
            for h, values in told.groupby("scale")["response"]
        ]
        known = np.isfinite(low)
        over = (
            f"over the range {fixed(found, digits, '+')}{unit} (95 %: {fixed(low, digits, '+')} to "
            f"{fixed(high, digits, '+')}, margin {margins[experiment]:g})"
            if known
            else "too few runs for a trend over the range"
        )
        sentence = (
            f"Enlarged by the {rule} rule, {how}, the {what} is "
            f"{', '.join(means) or 'unknown'}: {over}, {change}."
        )
        if len(told) < len(case):
            sentence += f" {len(case) - len(told)} of {len(case)} runs gave no value."
        out.append(
            Statement(  # type: ignore[call-arg]
                f"{experiment}.{rule}.{'cohesive' if cohesive else 'plain'}",
                "1.2.1, conclusion 4" if rule == PAPER_RULE.name else "(gravity kept)",
                f"The {what} does not change with the scale, {how}, under the {rule} rule",
                0.0,
                *((found, low, high) if known else (None, None, None)),
                VERDICT[change],
                sentence,
            )
        )
    return out


def exponent_statements(measured: Mapping[str, float]) -> list[Statement]:
    """The paper's exponents beside those measured in the engine, enlarged by the paper's own
    rule."""
    claims = (
        ("eq4.mass", "Eq. 4", "The mass factor is h", 1, "mass"),
        ("eq5.mass", "Eq. 5", "The mass factor is h^3", 3, "mass"),
        ("eq6.force", "Eq. 6", "The force factor is h^2 (contact, same relative overlap)", 2,
        "force"),
        ("eq2.weight", "Eqs. 2, 6", "The weight has the factor of every force, h^2", 2, "weight"),
        ("section121.stiffness", "1.2.1", "The contact stiffness goes as the diameter", 1,
        "stiffness"),
        ("section122.stiffness", "1.2.2", "k_n over R^2 is constant", 2, "stiffness"),
        ("section122.damping", "1.2.2", "c_n over R^2 is constant", 2, "damping_coefficient"),
    )  # fmt: skip
    out = []
    for name, where, text, printed, quantity in claims:
        found = measured[quantity]
        holds = abs(found - printed) < EXACT
        said = (
            f"The {quantity.replace('_', ' ')} measured in the engine goes as h^{fixed(found, 2)}"
        )
        verdict = HOLDS if holds else FAILS
        sentence = f"{said}; printed h^{printed}: the statement {verdict}."
        out.append(Statement(name, where, text, printed, found, found, found, verdict, sentence))
    return out


def theory_statements() -> list[Statement]:
    """What follows from the dimensions alone: Eq. 4's contradiction and the modulus under real
    gravity."""
    try:
        check_consistent({"length": 1, "mass": 1, "density": 0})
        contradiction = None
    except OverdeterminedError as error:
        contradiction = str(error)
    kept = int(exponent("modulus", PAPER_RULE.held))
    needed = int(exponent("modulus", GRAVITY_RULE.held))
    table = group_exponents(settings_of(PAPER_RULE, ("acceleration",)))
    broken = "; ".join(table.group[~table.kept])
    return [
        Statement(
            "eq4.consistent", "Eq. 4", "Length, mass and density scale as h, h and 1", None, None,
            None, None,
            FAILS if contradiction else HOLDS,
            f"Eq. 4 "
            f"{'contradicts itself: ' + contradiction if contradiction else 'is consistent'}.",
        ),
        Statement(
            "eq8.modulus", "Eq. 8", "Young's modulus is unchanged (velocity kept)", 0, kept, kept,
            kept,
            HOLDS if kept == 0 else FAILS,
            f"With velocity and density kept, Young's modulus goes as h^{kept}.",
        ),
        Statement(
            "eq8.modulus.gravity", "Eq. 8", "Young's modulus is unchanged where gravity acts", 0,
            needed, needed,
            needed, HOLDS if needed == 0 else FAILS,
            f"Where gravity is the Earth's at every scale, Young's modulus must go as h^{needed}; "
            f"unchanged it breaks "
            f"{broken}.",
        ),
    ]  # fmt: skip


def drop_statements(design: pd.DataFrame, config: Config) -> list[Statement]:
    """The exponents of impact speed and restitution over the scale, by a line through the
    logarithms of all drops."""
    drops = design[(design["experiment"] == "drop") & ~design["cohesive"]]
    drops = drops[drops["rule"] == PAPER_RULE.name]
    out = []
    for name, text, printed, metric in (
        ("section122.velocity", "Velocity is invariant", 0, "impact_speed_m_s"),
        ("section122.restitution", "The restitution goes as R^2", 2, "effective_restitution"),
    ):
        found, low, high = log_slope(drops["scale"], read_metric(drops["run_id"], metric))
        verdict = HOLDS if low - EXACT <= printed <= high + EXACT else FAILS
        sentence = (
            f"The {metric.rsplit('_m_s', 1)[0].replace('_', ' ')} of the drop, its rig enlarged "
            f"alike, goes as "
            f"h^{fixed(found, 2)} (95 %: {fixed(low, 2)} to {fixed(high, 2)}); printed "
            f"h^{printed}: the statement {verdict}."
        )
        out.append(Statement(name, "1.2.2", text, printed, found, low, high, verdict, sentence))
    return out


def log_slope(
    scale: Sequence[float] | np.ndarray | pd.Series, value: ArrayLike, alpha: float = 0.05
) -> tuple[float, float, float]:
    """(exponent, low, high) of a power law through values (n,) > 0 at scales (n,), by a line
    through the logarithms."""
    fit = scipy.stats.linregress(np.log(np.asarray(scale, float)), np.log(np.asarray(value, float)))
    half = float(scipy.stats.t.ppf(1 - alpha / 2, len(scale) - 2) * fit.stderr)
    return float(fit.slope), float(fit.slope) - half, float(fit.slope) + half


def scaling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write the table of responses, the figure and the statements. Raises CalibrationError where
    two statements have one id."""
    config, design = study.config, read_written(source.design)
    section = config.scaling
    response = np.empty(len(design))
    for experiment, metric in RESPONSE.items():
        here = (design["experiment"] == experiment).to_numpy()
        response[here] = read_values(design.loc[here, "run_id"], metric)
    heap = design["experiment"] == "heap"
    design.loc[heap, "left_in_funnel"] = read_values(design.loc[heap, "run_id"], "in_funnel")
    margins = {"heap": section.margin_deg, "drop": section.margin_restitution}  # type: ignore[union-attr]
    table = response_table(design, response, margins)
    base = base_run(config, "drop", False)
    measured = {
        rule.name: measured_exponents({h: enlarged(base, "drop", rule, h) for h in section.factors})  # type: ignore[union-attr]
        for rule in RULES.values()
    }
    statements = [
        *theory_statements(),
        *exponent_statements(measured[PAPER_RULE.name]),
        *drop_statements(design, config),
        *response_statements(design.assign(response=response), margins),
    ]
    if len({s.id for s in statements}) != len(statements):
        raise CalibrationError("two statements of the scaling study have the same id")
    write_table(design.assign(response=response), output.runs)
    write_table(table, output.table)
    figures.save(figures.scaling(table), output.figure)
    write_json(
        output.summary,
        {
            "statements": [asdict(s) for s in statements],
            "exponents": measured,
            "margins": {"angle_deg": margins["heap"], "restitution": margins["drop"]},
            "cohesion": section.cohesion,  # type: ignore[union-attr]
        },
    )
