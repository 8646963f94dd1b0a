"""The figure of a benchmark history: speed beside other engines, and cost over the number of
grains."""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING

import matplotlib

if TYPE_CHECKING:
    from pathlib import Path


matplotlib.use("Agg")
from matplotlib import pyplot as plt

LINE = "#4269d0"
NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}


def draw(history: str | Path, out: str | Path) -> None:
    """Draw the latest figures of each case in the CSV `history` to `out`; what was not measured has
    no panel."""
    latest = {row["case"]: row for row in _read(history)}
    panels = [(panel, found) for panel, read in PANELS if (found := read(latest))]
    if not panels:
        return
    figure, axes = plt.subplots(
        1, len(panels), figsize=(4.5 * len(panels), 3.2), layout="constrained", squeeze=False
    )
    for ax, (panel, found) in zip(axes[0], panels, strict=True):
        panel(ax, found)
    figure.savefig(out, metadata={"Date": None} if str(out).endswith(".svg") else None)
    plt.close(figure)


def _read(history):
    with open(history, newline="") as stream:
        return list(csv.DictReader(stream))


def _rates(latest):
    """Engine -> million particle-steps per second of the settled bed on one core, of the latest
    call with peers."""
    rows = {k.removeprefix("peers: "): r for k, r in latest.items() if k.startswith("peers: ")}
    return {NAMES.get(k, k): float(r["particle_steps_per_s"]) / 1e6 for k, r in rows.items()}


def _draw_rates(axes, rates):
    names = sorted(rates, key=rates.get)
    bars = axes.barh(names, [rates[n] for n in names], color=LINE)
    axes.bar_label(bars, [f"{rates[n]:.3g}" for n in names], padding=3)
    axes.margins(x=0.15)
    axes.set_xlabel("million particle-steps per second, one core")
    axes.set_title("Settled bed of 10,000 spheres")


def _costs(latest):
    """(spheres, ns per particle and step) of the settled beds, by size."""
    return sorted(
        (int(m[1]), 1e9 / float(row["particle_steps_per_s"]))
        for case, row in latest.items()
        if (m := re.fullmatch(r"settled bed of (\d+)", case))
    )


def _draw_costs(axes, points):
    axes.plot(*zip(*points, strict=True), "o-", color=LINE)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.3 * max(cost for _, cost in points))
    axes.set_xlabel("spheres")
    axes.set_ylabel("ns per particle and step")
    axes.set_title("Cost over size")


PANELS = ((_draw_rates, _rates), (_draw_costs, _costs))
