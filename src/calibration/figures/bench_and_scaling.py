"""The studies beside the chain: sweeps of the bench tests, yield loci, scaling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.figures.labels import ANGLE, label
from calibration.figures.style import BLUE, GREEN, GREY, ORANGE, subplots
from calibration.statistics.numbers import fixed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def sweep(
    levels: Sequence[float] | np.ndarray | pd.Series,
    response: Sequence[float] | np.ndarray | pd.Series,
    coefficients: np.ndarray,
    inverse: float,
    measured: float,
    factor: str,
    axis: str,
) -> Figure:
    """Sweep of a bench test with its quadratic and the inverse of the measured value; axis: label
    of the response. levels, response: (n,); coefficients: (3,), the highest power first."""
    figure, ax = subplots()
    x = np.linspace(min(levels), max(levels), 101)
    ax.plot(x, np.polyval(coefficients, x), color=GREY, label="quadratic fit")
    ax.scatter(levels, response, color=BLUE, zorder=3, label="simulated")
    ax.hlines(measured, min(levels), inverse, color=ORANGE, lw=1.2)
    ax.vlines(
        inverse, 0, measured, color=ORANGE, lw=1.2, label=f"measured {measured:g}: {inverse:.3f}"
    )
    ax.set(xlabel=label(factor), ylabel=axis, ylim=(0, 1.05 * max(response)))
    # above the axes: the line of the measured value may run anywhere within
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=9)
    return figure


def yield_loci(
    runs: pd.DataFrame,
    loci: Sequence[Mapping[str, Any]],
    curves: Mapping[str, Any],
    measure: str,
    measured: tuple[float, float],
) -> Figure:
    """Yield loci at each particle friction, and the slope over the friction with its interval,
    beside the measured.

    runs: columns particle_friction, normal_stress_kPa and, for each measure, <measure>_kPa;
    measured: slope and intercept [kPa].
    """
    figure, (left, right) = subplots(1, 2, (9.6, 4.2))
    end = 1.05 * runs["normal_stress_kPa"].max()
    x = np.array([0.0, end])
    for locus in loci:
        friction, line = locus["particle_friction"], locus[measure]
        points = runs[runs["particle_friction"] == friction]
        text = f"µ {friction:g}: {fixed(line['slope'], 2)} x {fixed(line['intercept_kPa'], 2, '+')}"
        (drawn,) = left.plot(x, line["slope"] * x + line["intercept_kPa"], label=text)
        left.scatter(
            points["normal_stress_kPa"], points[f"{measure}_kPa"], color=drawn.get_color(), s=18
        )
    slope, intercept = measured
    text = f"measured: {slope:g} x {intercept:+g}"
    left.plot(x, slope * x + intercept, color="black", ls="--", label=text)
    left.set(
        xlabel="normal stress [kPa]",
        ylabel=f"{measure} shear stress [kPa]",
        xlim=(0, None),
        ylim=(0, None),
    )
    left.legend(frameon=False, fontsize=8)
    for (name, curve), colour in zip(curves.items(), (BLUE, GREEN), strict=True):
        mu = np.linspace(curve.low, curve.high, 101)
        value, half = curve.at(mu)
        right.plot(mu, value, color=colour, label=name)
        right.fill_between(mu, value - half, value + half, color=colour, alpha=0.15, lw=0)
    right.axhline(slope, color="black", ls="--", lw=1, label=f"measured {slope:g}")
    right.plot(mu, mu, color=GREY, ls=":", label="slope = particle friction")
    right.set(xlabel="particle friction", ylabel="slope of the yield locus")
    right.legend(frameon=False, fontsize=8)
    return figure


def scaling(table: pd.DataFrame) -> Figure:
    """Angle of repose and restitution over the scale, a line a rule and cohesion."""
    figure, axes = subplots(1, 2, (9.6, 4.2))
    names = {"heap": ANGLE.axis, "drop": "coefficient of restitution, rebound"}
    for ax, (experiment, axis) in zip(axes, names.items(), strict=True):
        cases = table[table["experiment"] == experiment].groupby(["rule", "cohesive"], sort=False)
        for k, ((rule, cohesive), case) in enumerate(cases):
            text = f"{rule} rule, {'cohesive' if cohesive else 'no cohesion'}"
            ax.errorbar(
                case["scale"] * 2 ** (0.03 * (k - 1.5)),
                case["mean"],
                yerr=[case["mean"] - case["low"], case["high"] - case["mean"]],
                marker="o",
                capsize=3,
                label=text,
            )
        ax.set_xscale("log", base=2)
        scales = sorted(table["scale"].unique())
        ax.set_xticks(scales, [f"{x:g}" for x in scales])
        ax.set(xlabel="scale h", ylabel=axis)
    lines = axes[0].get_legend_handles_labels()
    figure.legend(*lines, loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    return figure
