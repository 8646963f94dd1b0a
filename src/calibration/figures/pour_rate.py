"""The response over the rate at which grains arrive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calibration.figures.labels import ANGLE
from calibration.figures.style import BLUE, GREY, ORANGE, subplots

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from calibration.figures.labels import Response


def pour_rate(
    runs: pd.DataFrame, table: pd.DataFrame, capacity: float, fed: float, response: Response = ANGLE
) -> Figure:
    """Single heaps and the mean of each rate with its interval; the rate that the orifice passes,
    and the opened funnel as a band.

    runs: columns rig, response; table: rig, rate_per_s (NaN of the opened funnel), mean, low, high;
    capacity, fed: grains per second.
    """
    figure, ax = subplots(size=(6.4, 3.8))
    rained = table[table["rate_per_s"].notna()]
    single = runs[runs["rig"].astype(str) != "opened"]
    ax.scatter(single["rig"].astype(float), single["response"], s=14, color=BLUE, alpha=0.4)
    reach = np.array([rained["mean"] - rained["low"], rained["high"] - rained["mean"]])
    ax.errorbar(
        rained["rate_per_s"], rained["mean"], reach, color=BLUE, marker="o", capsize=3,
        label="rain through the open funnel, mean and 95 %",
    )  # fmt: skip
    for row in table[table["rate_per_s"].isna()].to_dict("records"):
        ax.axhspan(row["low"], row["high"], color=ORANGE, alpha=0.2, lw=0)
        ax.axhline(row["mean"], color=ORANGE, lw=1.5, label="filled funnel that is opened")
    ax.axvline(capacity, color="black", ls="--", lw=1, label="the orifice passes (Beverloo)")
    ax.axvline(fed, color=GREY, ls=":", lw=1.5, label="this study")
    ax.set(xlabel="grains made per second", ylabel=response.axis)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    return figure
