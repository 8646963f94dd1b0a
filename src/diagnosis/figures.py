"""Figures of the diagnosis; each returns a matplotlib Figure."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import ticker
from matplotlib.figure import Figure

from calibration.figures import BLUE, GREY, ORANGE, label, subplots
from calibration.intake.quantities import LEVERS, QUANTITIES

LARGE = 10.0  # nats from which on the axis of gains is logarithmic


def _panels(rows):
    """[(experiment, lever or None, rows)]: a panel for each lever that varies, one for experiments
    that vary none."""
    panels, single = [], []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = [r for r in rows if r["experiment"] == kind]
        varied = [
            lever
            for lever in dict.fromkeys(n for r in own for n in r["levers"])
            if len({r["levers"].get(lever) for r in own} - {None}) > 1
        ]
        panels += [(kind, lever, [r for r in own if lever in r["levers"]]) for lever in varied]
        single += [] if varied else own
    return panels + ([(None, None, single)] if single else [])


def _draw_axes(panels, height=3.2):
    figure, axes = subplots(1, len(panels), size=(3.4 * len(panels), height), squeeze=False)
    return figure, zip(axes[0], panels, strict=True)


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
    known = LEVERS.get(lever)
    name, unit = (known.words, known.unit) if known else (label(lever), "")
    axis.set(xlabel=f"{name} [{unit}]" if unit else name, title=QUANTITIES[kind].words)
    if axis.dataLim.xmin <= 0.0:  # a recorded number
        return
    axis.set(xscale="log")
    axis.xaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(ticker.NullFormatter())


def residual_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Standardised residuals of the base model along every lever that varies."""
    figure, drawn = _draw_axes(_panels(rows))
    for axis, (kind, lever, own) in drawn:
        axis.axhspan(-2, 2, color=GREY, alpha=0.15, linewidth=0)
        axis.axhline(0, color=GREY, linewidth=1)
        y = [r["standardised"] for r in own]
        axis.plot(_places(own, lever), y, "o", color=BLUE)
        _name_axis(axis, kind, lever)
        axis.set_ylabel("(measured - model) / sd")
    return figure


def prediction_figure(
    rows: Sequence[Mapping[str, Any]], extended: np.ndarray | None, name: str
) -> Figure:
    """Measured values over the predictions of the base model (rows) and of the extended one
    (values, or None)."""
    predicted = {} if extended is None else dict(zip(map(id, rows), extended, strict=True))
    figure, drawn = _draw_axes(_panels(rows), 3.6)
    for axis, (kind, lever, own) in drawn:
        x = _places(own, lever)
        base = np.array([r["predicted"] for r in own])
        ratio = np.array([r["measured"] for r in own]) / base
        error = [2.0 * r["sd"] for r in own] / base
        axis.axhline(1, color=GREY, linewidth=1)
        axis.errorbar(x, ratio, error, fmt="o", color=BLUE, capsize=3, label="measured, ±2 sd")
        if predicted:
            after = np.array([predicted[id(r)] for r in own]) / base
            axis.plot(x, after, "s", color=ORANGE, mfc="none", label=f"with {label(name)}")
        _name_axis(axis, kind, lever)
        axis.set_ylabel("value / prediction of the base model")
        axis.legend(fontsize=8, frameon=False)
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
    for key, marker, colour in (("miss_before", "o", BLUE), ("miss_after", "s", ORANGE)):
        name = "base model" if key == "miss_before" else "extended model"
        axis.plot([p[key] for p in points], y, marker, color=colour, label=name)
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
