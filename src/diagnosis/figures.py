"""Figures of the diagnosis; each returns a matplotlib Figure."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import ticker
from matplotlib.figure import Figure

from calibration.figures import BLUE, GREY, ORANGE, label, subplots
from calibration.intake.quantities import LEVERS, QUANTITIES
from diagnosis.page.words import lever_of

LARGE = 10.0  # nats from which on the axis of gains is logarithmic


def _panels(rows):
    """[(experiment, lever or None, rows)]: a panel for each lever that varies, one for experiments
    that vary none."""
    panels, single = [], []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = [r for r in rows if r["experiment"] == kind]
        levels = pd.DataFrame([r["levers"] for r in own])
        varied = levels.columns[levels.nunique() > 1]
        panels += [(kind, lever, [r for r in own if lever in r["levers"]]) for lever in varied]
        single += [] if len(varied) else own
    return panels + ([(None, None, single)] if single else [])


def _places(rows, lever):
    """Where rows stand along a lever; without one their names, in lines so short that neighbours do
    not meet."""
    if lever is None:
        return [fill(QUANTITIES[r["experiment"]].words, 9) for r in rows]
    return [r["levers"][lever] for r in rows]


def _name_axis(axis, kind, lever):
    if lever is None:
        axis.set_title("single settings")
        axis.margins(x=0.4)
        return
    name, unit = lever_of(lever)
    axis.set(xlabel=f"{name} [{unit}]" if unit else name, title=QUANTITIES[kind].words)
    if axis.dataLim.xmin <= 0.0:  # a recorded number
        return
    axis.set(xscale="log")
    axis.xaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(ticker.NullFormatter())


def residual_figure(
    rows: Sequence[Mapping[str, Any]], extended: np.ndarray | None = None, name: str = ""
) -> Figure:
    """Standardised residuals along every lever that varies: of the base model and, where it
    predicts the values `extended` (n,), of the model with `name`."""
    if extended is not None:
        rows = [{**r, "after": value} for r, value in zip(rows, extended, strict=True)]
    panels = _panels(rows)
    figure, axes = subplots(1, len(panels), size=(3.4 * len(panels), 3.2), squeeze=False)
    for axis, (kind, lever, own) in zip(axes[0], panels, strict=True):
        axis.axhspan(-2, 2, color=GREY, alpha=0.15, linewidth=0)
        axis.axhline(0, color=GREY, linewidth=1)
        x = _places(own, lever)
        y = [r["standardised"] for r in own]
        axis.plot(x, y, "o", color=BLUE, label="base model")
        if extended is not None:
            left = [(r["measured"] - r["after"]) / r["sd"] for r in own]
            axis.plot(x, left, "s", color=ORANGE, mfc="none", label=f"with {label(name)}")
            axis.legend(fontsize=8, frameon=False)
        _name_axis(axis, kind, lever)
        axis.set_ylabel("(measured - model) / sd")
    return figure


def gain_figure(gain: Mapping[str, Any] | None) -> Figure:
    """Miss at each setting when it was left out: base and extended model, run with the real engine.

    gain: the mapping of `extend.gain`, or None where no model was extended.
    """
    points = gain["points"] if gain else []
    points = sorted(points, key=lambda p: (p["experiment"], *p["levers"].values()), reverse=True)
    figure, axis = subplots(size=(6.4, 1.0 + 0.3 * len(points)))
    y = np.arange(len(points))
    axis.axvspan(-2, 2, color=GREY, alpha=0.15, linewidth=0)
    axis.axvline(0, color=GREY, linewidth=1)
    axis.plot([p["miss_before"] for p in points], y, "o", color=BLUE, label="base model")
    axis.plot([p["miss_after"] for p in points], y, "s", color=ORANGE, label="extended model")
    axis.set_yticks(y, [_setting(p) for p in points], fontsize=8)
    axis.set_xlabel("(measured - simulated) / standard error, setting left out of the fit")
    if points:
        axis.legend(fontsize=8, frameon=False)
    else:
        axis.set_title("no cause named, so no model was extended")
    return figure


def _setting(point):
    levers = [f"{v:.4g} {LEVERS[n].unit}".strip() for n, v in point["levers"].items()]
    return ", ".join([QUANTITIES[point["experiment"]].words, *levers])


def ranking_figure(verdict: Mapping[str, Any]) -> Figure:
    """Gain of each mechanism in log evidence, with its own null threshold and that of the best."""
    rows = [r for r in verdict["ranking"] if "p" in r][::-1]
    figure, axis = subplots(size=(6.4, 0.6 + 0.32 * max(len(rows), 2)))
    y = np.arange(len(rows))
    colours = [ORANGE if r["mechanism"] in verdict["causes"] else BLUE for r in rows]
    axis.barh(y, [r["gain"] for r in rows], color=colours, height=0.6)
    axis.plot([r["null_threshold"] for r in rows], y, "|", color="black", markersize=12)
    axis.axvline(verdict["null_threshold_best"], color=GREY, linestyle="--")
    axis.set_yticks(y, [label(r["mechanism"]) for r in rows])
    axis.set_xlabel("gain in log evidence [nats]")
    axis.set_title("dashed: threshold for the best of all")
    if np.abs(axis.dataLim.intervalx).max() > LARGE:
        axis.set_xscale("symlog", linthresh=LARGE)
    return figure
