"""Figure of the benchmark: power against strength, confusion matrix, false alarms and decoys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from calibration.figures import BLUE, GREY, label, subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure


RATES = {
    "no effect, grains: adequate": "no effect, single grains: adequate",
    "no effect, heap: adequate": "no effect, heaps: adequate",
    "no effect, shear: adequate": "no effect, shear cell: adequate",
    "no effect, grains: identified": "no effect, single grains: identified",
    "outlier: identified": "outlier: identified",
    "understated: identified": "noise twice as stated: identified",
    "all mechanisms, strength 1: named first": "mechanisms: named first",
    "as large as moderate: named first": "mechanisms of moderate size: named first",
    "all mechanisms, strength 1: identified and wrong": "mechanisms: identified and wrong",
    "outside the catalogue: identified": "not in the catalogue: identified",
    "pairs: both named": "pairs: both named",
}


def benchmark_figure(table: pd.DataFrame, rates: pd.DataFrame) -> Figure:
    """table: of all cases; rates: of `benchmark.summarise`."""
    figure, (power, matrix, bars) = subplots(1, 3, size=(17, 5.2), width_ratios=[1, 1.4, 0.8])
    _power(power, table)
    _confusion(matrix, table)
    _rates(bars, rates.set_index("what"))
    return figure


def _power(axis, table):
    styles = ["o-", "s--", "^:", "v-."]
    hidden = table[table["case"] == "mechanism"]
    for k, (name, own) in enumerate(hidden.groupby("truth")):
        power = own.groupby("size")["named_first"].mean()
        axis.plot(power.index, power.values, styles[k % 4], label=label(name), alpha=0.8)
    axis.set(
        xlabel="size of the effect where it shows most [standard errors]",
        ylabel="share named first",
        ylim=(-0.03, 1.03),
    )
    axis.legend(fontsize=7, frameon=False)


def _confusion(axis, table):
    at = table[table["case"].isin(["no effect", "mechanism"])]
    at = at[(at["strength"] == 1.0) | (at["case"] == "no effect")]
    truth = np.where(at["truth"] == "", at["case"], at["truth"])
    counts = pd.crosstab(truth, at["outcome"].to_numpy())
    share = counts.div(counts.sum(axis=1), axis=0)
    axis.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    names = [label(c) for c in share.columns]
    axis.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=7)
    axis.set_yticks(range(len(share)), [label(r) for r in share.index], fontsize=7)
    for i, row in enumerate(counts.to_numpy()):
        for j, count in enumerate(row):
            if count:
                ink = "white" if share.iat[i, j] > 0.5 else "black"
                axis.text(j, i, int(count), ha="center", va="center", fontsize=7, color=ink)
    axis.set(xlabel="verdict", ylabel="hidden")
    axis.grid(visible=False)


def _rates(axis, rates):
    known = [w for w in RATES if w in rates.index][::-1]
    own = rates.loc[known]
    y = np.arange(len(own))
    axis.hlines(y, own["low"], own["high"], color=GREY, linewidth=3)
    axis.plot(own["share"], y, "o", color=BLUE)
    names = [f"{RATES[w]} ({n})" for w, n in zip(own.index, own["n"], strict=True)]
    axis.set_yticks(y, names, fontsize=7)
    axis.set(xlabel="share, 95 % interval", xlim=(-0.03, 1.03))
