"""The benchmark's rates as Markdown: what the documentation shows is what the cases gave."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calibration.figures import label

if TYPE_CHECKING:
    import pandas as pd


RATES = (
    ("all mechanisms, strength 1: named first", "90 %"),
    ("as large as moderate: named first", "90 %"),
    ("at no strength so large: named first", ""),
    ("all mechanisms, strength 1: identified and right", ""),
    ("all mechanisms, strength 1: identified and wrong", ""),
    ("no effect, grains: adequate", "95 %"),
    ("no effect, heap: adequate", "95 %"),
    ("no effect, shear: adequate", "95 %"),
    ("no effect, grains: identified", ""),
    ("no effect, heap: identified", ""),
    ("no effect, shear: identified", ""),
    ("outlier: identified", "0"),
    ("understated: identified", "0"),
    ("outside the catalogue: identified", "at most 5 %"),
    ("pairs: both named", "most"),
    ("too little data: ambiguous", ""),
    ("too little data: identified and right", ""),
    ("too little data: identified and wrong", ""),
    ("ambiguous, and 1 proposed measurements more: identified and right", "most"),
    ("ambiguous, and 2 proposed measurements more: identified and right", "most"),
)
"""Rate of `benchmark.summarise` and what is asked of it."""


CASES = {
    "removed": "a mechanism, taken out of the catalogue",
    "undecided": "too little data",
    "understated": "noise twice as large as stated",
}
"""Words of the cases whose names need some."""

VERDICTS = ("adequate", "identified", "discovered", "ambiguous", "unexplained")


def page(table: pd.DataFrame, rates: pd.DataFrame) -> str:
    """Three tables: the rates with their 95 % intervals, the verdicts, the mechanisms one by one.

    table: of all cases; rates: of `benchmark.summarise`.
    """
    of = rates.set_index("what")
    lines = ["| | share (95 % interval) | asked |", "|---|---|---|"]
    lines += [
        f"| {name} | {_share(of.loc[name])} | {asked} |"
        for name, asked in RATES
        if name in of.index
    ]
    lines += ["", *_verdicts(table)]
    lines += [
        "",
        "| hidden | moderate strength | size [standard errors] | named first | identified and "
        "right | at half the size: named first | taken out of the catalogue: identified |",
        "|---|---|---|---|---|---|---|",
    ]
    full = table[(table["case"] == "mechanism") & (table["strength"] == 1.0)]
    for (bench, name), own in full.groupby(["bench", "truth"]):
        weak = table[
            (table["case"] == "mechanism") & (table["truth"] == name) & (table["strength"] < 1.0)
        ]
        out = table[(table["case"] == "removed") & (table["truth"] == name)]
        strength = own["hidden"].iloc[0].removesuffix(" 1")
        lines.append(
            f"| {label(name)} ({bench}) | {strength} | {own['size'].iloc[0]:.1f} | "
            f"{_count(own['named_first'])} | {_count(_right(own))} | "
            f"{_count(weak['named_first'])} | "
            f"{_count(out['verdict'] == 'identified')} |"
        )
    return "\n".join(lines) + "\n"


def _verdicts(table):
    """Markdown of how often each verdict was given, by what was hidden."""
    lines = [
        "| hidden | data sets | adequate | identified: right, wrong | ambiguous | unexplained |",
        "|---|---|---|---|---|---|",
    ]
    full = table[(table["case"] == "mechanism") & (table["strength"] == 1.0)]
    weak = table[(table["case"] == "mechanism") & (table["strength"] < 1.0)]
    groups = [("a mechanism, moderate", full), ("a mechanism, half of that", weak)]
    rest = table[table["case"] != "mechanism"].groupby("case")
    groups += [(CASES.get(case, case), own) for case, own in rest]
    for name, own in groups:
        right = int(_right(own).sum())
        count = {v: int((own["verdict"] == v).sum()) for v in VERDICTS}
        shown = f"{right}, {count['identified'] - right}"
        lines.append(
            f"| {name} | {len(own)} | {count['adequate']} | {shown} | {count['ambiguous']} "
            f"| {count['unexplained']} |"
        )
    return lines


def _right(own):
    return (own["verdict"] == "identified") & (own["outcome"] == own["truth"])


def _share(rate):
    n = int(rate["n"])
    return (
        f"{round(rate['share'] * n)} of {n} ({100 * rate['low']:.0f}% to {100 * rate['high']:.0f}%)"
    )


def _count(hits):
    return f"{int(hits.sum())} of {len(hits)}" if len(hits) else "not run"
