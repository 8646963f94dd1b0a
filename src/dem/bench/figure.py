"""The figure of a benchmark history: speed beside other engines, and cost over the number of grains."""

import csv
import re

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

LINE = "#4269d0"


def draw(history, out):
    """Draw the latest figures of each case in the CSV `history` to `out`."""
    latest = {row["case"]: row for row in _read(history)}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    _peers(left, latest)
    _sizes(right, latest)
    figure.savefig(out, metadata={"Date": None} if str(out).endswith(".svg") else None)
    plt.close(figure)


def _read(history):
    with open(history, newline="") as stream:
        return list(csv.DictReader(stream))


def _peers(axes, latest):
    rows = {k.removeprefix("peers: "): r for k, r in latest.items() if k.startswith("peers: ")}
    rates = {name: float(r["particle_steps_per_s"]) / 1e6 for name, r in rows.items()}
    names = sorted(rates, key=rates.get)
    bars = axes.barh(names, [rates[n] for n in names], color=LINE)
    axes.bar_label(bars, [f"{rates[n]:.3g}" for n in names], padding=3)
    axes.margins(x=0.15)
    axes.set_xlabel("million particle-steps per second, one core")
    axes.set_title("Settled bed of 10,000 spheres")


def _sizes(axes, latest):
    points = sorted(
        (int(m[1]), 1e9 / float(row["particle_steps_per_s"]))
        for case, row in latest.items()
        if (m := re.fullmatch(r"settled bed of (\d+)", case))
    )
    if points:
        axes.plot(*zip(*points, strict=True), "o-", color=LINE)
        axes.set_xscale("log")
        axes.set_ylim(0, 1.3 * max(cost for _, cost in points))
    axes.set_xlabel("spheres")
    axes.set_ylabel("ns per particle and step")
    axes.set_title("Cost over size")
