"""What the posterior says, in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calibration.figures import label, response_of

if TYPE_CHECKING:
    from calibration.figures import Response


TOGETHER = 0.4  # correlation from which on two parameters are said to go together
TELLS = 0.9  # of today's standard deviation: a measurement that leaves more tells little


def sentences(summary: Mapping[str, Any], response: Response) -> list[str]:
    """What came out, for the report."""
    return [
        s
        for s in (
            known(summary),
            together(summary),
            _forward(summary, response),
            _without_value(summary),
            following(summary, response),
            *_weighed(summary),
            *_doubts(summary),
        )
        if s
    ]


def known(summary: Mapping[str, Any]) -> str:
    """Which parameters the measurements bound, and which stay as open as the region."""
    bounded, left = [], []  # type: list[str], list[str]
    for name, p in summary["parameters"].items():
        ends = p["interval"] if p["bounded"] else summary["box"][name]
        text = f"{label(name)} {ends[0]:.3g} to {ends[1]:.3g}"
        (bounded if p["bounded"] else left).append(text)
    said = []
    if bounded:
        level = f"{100 * summary['level']:.0f} %"
        said.append(f"With {level} probability: {', '.join(bounded)}.")
    if left:
        said.append(
            f"The measurements do not narrow these within the region searched: {', '.join(left)}."
        )
    return " ".join(said)


def together(summary: Mapping[str, Any]) -> str:
    """Which parameters hang together, of a mapping with `parameters` and their `correlation`; empty
    where none do."""
    names, rows = list(summary["parameters"]), summary["correlation"]
    found = [
        f"{label(names[i])} and {label(names[j])} ({rows[i][j]:+.2f})"
        for i in range(len(names))
        for j in range(i)
        if abs(rows[i][j]) >= TOGETHER
    ]
    if not found:
        return ""
    return (
        f"The parameters are not free of each other; correlated are {', '.join(found)}. Take a row "
        "of draws.csv, not one end of each interval."
    )


def _forward(summary, response):
    mean, run = (summary["pushed_forward"][k] for k in ("mean", "run"))
    low, high = (response.value(x) for x in mean)
    first, last = (response.value(x) for x in run)
    return (
        f"Over the whole distribution the mean {response.name} is expected between {low} and "
        f"{high}. A single run is expected between {first} and {last}."
    )


def _without_value(summary):
    runs, trained = len(summary.get("without_value", ())), summary["trained_by"]
    if not runs:
        return ""
    return (
        f"{runs} of {runs + trained} runs here gave no value. Where that is likely the parameters "
        f"are less probable, since every test of the laboratory gave one."
    )


def following(summary: Mapping[str, Any], response: Response) -> str:
    """The measurement that is expected to tell most, and what it leaves of the parameters."""
    rows = summary["next_experiment"]
    if not rows:
        return ""
    best = rows[0]
    left = _left(best)
    name, share = min(left.items(), key=lambda pair: pair[1])
    metric, meaning = response_of(best["metric"]).name, best["meaning"]
    named = meaning if meaning.startswith(metric) else f"{metric} ({meaning})"
    readings = f"{summary['readings']} readings of {named}"
    if share > TELLS:
        return (
            f"No measurement of this experiment is expected to tell much: the best, {readings}, "
            f"leaves {share:.0%} of the spread of "
            f"{label(name)}. Another experiment is needed."
        ).replace("%", " %")
    return (
        f"What pins them down next: {readings} are expected "
        f"to leave {share:.0%} of the spread of {label(name)}."
    ).replace("%", " %")


def _left(row):
    return {k.removesuffix(" left"): v for k, v in row.items() if k.endswith(" left")}


def _weighed(summary):
    """What the grains on the plate tell: they can be weighed, and are simulated already."""
    rows = [row for row in summary["next_experiment"] if row["metric"] == "on_plate"]
    if not rows or rows[0]["measured"]:
        return []
    row, poured = rows[0], summary.get("grains")
    left = ", ".join(f"{label(n)} {v:.0%}" for n, v in _left(row).items()).replace("%", " %")
    share = ""
    if poured:
        ends = (f"{100 * row[end] / poured:.1f}" for end in ("low", "high"))
        share = f" ({' to '.join(ends)} % of those poured)"
    return [
        f"The mass on the plate needs a weighing and no run. The distribution expects "
        f"{row['low']:.0f} to {row['high']:.0f} grains there{share}, and {summary['readings']} "
        f"heaps tell their mean to ±{row['error']:.0f}. Of the spread it would leave {left}."
    ]


def _doubts(summary):
    sampler = summary["sampler"]
    if sampler["converged"]:
        return []
    return [
        f"The sampler's chains are short: they are worth {sampler['effective']:.0f} independent "
        f"draws. The ends of the intervals are uncertain."
    ]
