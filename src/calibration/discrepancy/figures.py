"""Figures of the diagnosis; each returns a matplotlib Figure."""

import numpy as np
import pandas as pd

from calibration.discrepancy.residuals import NAMES
from calibration.figures import BLUE, GREY, ORANGE, _axes, label


def residual_figure(rows):
    """Standardised residuals of the base model along every lever that varies."""
    panels = []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = [r for r in rows if r["experiment"] == kind]
        for lever in dict.fromkeys(n for r in own for n in r["levers"]):
            values = {r["levers"].get(lever) for r in own} - {None}
            if len(values) > 1:
                panels.append((kind, lever, [r for r in own if lever in r["levers"]]))
    count = max(len(panels), 1)
    figure, axes = _axes(1, count, size=(3.4 * count, 3.2), squeeze=False)
    for axis, (kind, lever, own) in zip(axes[0], panels, strict=False):
        axis.axhspan(-2, 2, color=GREY, alpha=0.15, linewidth=0)
        axis.axhline(0, color=GREY, linewidth=1)
        axis.plot(
            [r["levers"][lever] for r in own], [r["standardised"] for r in own], "o", color=BLUE
        )
        axis.set(xscale="log", xlabel=label(lever), title=NAMES[kind])
        axis.set_ylabel("(measured - model) / sd")
    return figure


def ranking_figure(verdict):
    """Gain of each mechanism in held-out log density, with its own null threshold and that of the best."""
    rows = [r for r in verdict["ranking"] if "p" in r][::-1]
    figure, axis = _axes(size=(6.4, 0.6 + 0.32 * max(len(rows), 2)))
    y = np.arange(len(rows))
    colours = [ORANGE if r["mechanism"] in verdict["causes"] else BLUE for r in rows]
    axis.barh(y, [r["gain"] for r in rows], color=colours, height=0.6)
    axis.plot([r["null_threshold"] for r in rows], y, "|", color="black", markersize=12)
    axis.axvline(verdict["null_threshold_best"], color=GREY, linestyle="--")
    axis.set_yticks(y, [label(r["mechanism"]) for r in rows])
    axis.set_xlabel("gain in held-out log density [nats]")
    axis.set_title("dashed: threshold for the best of all")
    axis.set_xscale("symlog", linthresh=10)
    return figure


def benchmark_figure(table):
    """Power against strength, and the confusion matrix at the moderate strength."""
    figure, (left, right) = _axes(1, 2, size=(12, 4.8))
    hidden = table[table["case"].isin(["mechanism"])]
    for name, own in hidden.groupby("truth"):
        power = own.groupby("strength")["named_first"].mean()
        left.plot(power.index, power.values, "o-", label=label(name))
    left.set(
        xlabel="strength over the moderate one", ylabel="share named first", ylim=(-0.02, 1.02)
    )
    left.legend(fontsize=7)
    at = table[(table["strength"] == 1.0) | (table["case"] != "mechanism")]
    truth = [t if c == "mechanism" else c for t, c in zip(at["truth"], at["case"], strict=True)]

    matrix = pd.crosstab(pd.Series(truth, name="hidden"), at["outcome"].reset_index(drop=True))
    share = matrix.div(matrix.sum(axis=1), axis=0)
    right.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    right.set_xticks(
        range(len(share.columns)),
        [label(c) for c in share.columns],
        rotation=60,
        ha="right",
        fontsize=7,
    )
    right.set_yticks(range(len(share)), [label(r) for r in share.index], fontsize=7)
    for i, row in enumerate(matrix.to_numpy()):
        for j, count in enumerate(row):
            if count:
                ink = "white" if share.iat[i, j] > 0.5 else "black"
                right.text(j, i, int(count), ha="center", va="center", fontsize=7, color=ink)
    right.grid(visible=False)
    return figure
