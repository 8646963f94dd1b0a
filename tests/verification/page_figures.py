"""Figures of the verification page that are drawn from recorded values rather than by a test."""

from pathlib import Path

import numpy as np

from calibration.figures import ANGLE, BLUE, GREY, ORANGE, save, styled
from calibration.stages.numerics import numerics_figure

FOLDER = Path(__file__).parents[2] / "docs" / "verification"


def _axes(width=5.6, height=3.8):
    with styled() as plt:
        return plt.subplots(figsize=(width, height), layout="constrained")


def _keep(fig, name):
    save(fig, FOLDER / f"{name}.svg")


def overview(records):
    """Deviation of every judged value as a share of its tolerance, by topic; returns the
    caption."""
    judged = [r for r in records if r.get("tolerance")]
    topics = sorted({r["topic"] for r in judged}, key=str.lower)
    fig, ax = _axes(7.2, 0.24 * len(topics) + 1.0)
    for r in judged:
        share = (r["value"] - r["reference"]) / r["tolerance"]
        ax.plot(share, topics.index(r["topic"]), "o", ms=3.5, alpha=0.5, color=BLUE)
    for edge in (-1, 1):
        ax.axvline(edge, color=ORANGE, linestyle="--", linewidth=1)
    ax.set_yticks(range(len(topics)), topics, fontsize=8)
    ax.invert_yaxis()
    ax.set_xlabel("(engine - reference) / tolerance")
    _keep(fig, "overview")
    text = "the deviation from the reference as a share of the tolerance."
    return f"All {len(judged)} judged values: {text}"


def restitution(rows, name):
    fig, ax = _axes()
    asked = np.array([r["reference"] for r in rows])
    ax.plot(asked, np.array([r["value"] for r in rows]) - asked, "o", ms=4, alpha=0.6)
    ax.axhline(0.0, color=GREY, linewidth=1)
    ax.set(xlabel="restitution asked for", ylabel="restitution found - asked for")
    _keep(fig, name)
    return "Restitution found less restitution asked for, 200 steps in a contact."


def steps_in_a_contact(rows, name):
    fig, ax = _axes()
    steps = [int(r["quantity"].split()[1]) for r in rows]
    ax.semilogx(steps, [r["value"] for r in rows], "o-", label="engine")
    ax.axhline(0.5, color=GREY, linewidth=1, label="asked for")
    ax.set_xticks(steps, steps)
    ax.minorticks_off()
    ax.set(xlabel="time steps in an impact", ylabel="restitution")
    ax.legend(fontsize=8)
    _keep(fig, name)
    return (
        "Restitution over the time steps in an impact, mean over the moment of touch within a step."
    )


def kharaz(rows, name):
    fig, ax = _axes()
    angle = [int(r["quantity"].split()[-2]) for r in rows]
    ax.plot(angle, [-r["reference"] for r in rows], "o", color=ORANGE, label="measured")
    ax.plot(angle, [-r["value"] for r in rows], "-", color=BLUE, label="engine")
    ax.set(xlabel="angle of impact from the normal [°]", ylabel="spin after the impact [rad/s]")
    ax.legend(fontsize=8)
    _keep(fig, name)
    return "Spin after oblique impact of an aluminium oxide sphere on glass at 3.9 m/s."


def cone(rows, name):
    fig, ax = _axes()
    for r in rows:
        radial, size = r["quantity"].startswith("radial"), r["quantity"].split(" of ")[1][0]
        error = r["value"] - r["reference"]
        face = "none" if radial else BLUE
        mark = {"1": "o", "2": "s", "4": "^"}[size]
        ax.plot(r["reference"], error, mark, ms=5, mfc=face, mec=BLUE)
    ax.axhline(0.0, color=GREY, linewidth=1)
    ax.set(xlabel="angle of the cone [°]", ylabel="angle measured - angle of the cone [°]")
    _keep(fig, name)
    return (
        "Angle measured less angle of the cone: grains of 1, 2, 4 mm as circles, squares, "
        "triangles; filled: "
        "silhouettes, open: radial surface."
    )


OF_TOPIC = {
    "restitution": restitution,
    "steps in a contact": steps_in_a_contact,
    "Kharaz (2001)": kharaz,
    "angle of repose of a cone": cone,
}


def numerics(table):
    """Differences between numerical choices with their intervals; returns the caption."""
    _keep(numerics_figure(table, ANGLE), "numerics")
    return "Angle of repose of each variant less that of the variant it is compared with."
