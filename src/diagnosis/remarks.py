"""Remarks on what the settings of a table cannot tell, and its tests that ended without a value."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from scipy.special import expit

from calibration.intake.quantities import LEVERS, QUANTITIES, levers_of
from diagnosis.page.words import chance

if TYPE_CHECKING:
    from diagnosis.bulk import Bulk
    from diagnosis.measurements import Measured


def remarks(measured: Measured, counted: Collection[str] = ()) -> list[str]:
    """Sentences, each with its lines, on what a `Measured` table cannot tell; counted: experiments
    whose tests without a value entered the fits."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measured.fitted):
        own = [m for m in measured.fitted if m.experiment == kind]
        out += _few_levels(kind, own)
        for name in ("batch", "instrument"):
            out += _alone(name, own)
        if kind in measured.singly:
            what = measured.singly[kind]
            beside = "their order" if what["of"] == "order" else what["of"].replace("_", " ")
            out.append(
                f"The readings of the {QUANTITIES[kind].words} go with {beside} within their "
                f"settings ({chance(what['p'])} of tables look so by chance): each is taken by "
                "itself."
            )
        out += [
            f"{_lines([m for m in own if name in m.pooled])}: {name} differs among the readings of "
            "a setting, and their mean is used: two readings or more at each value tell more."
            for name in dict.fromkeys(n for m in own for n in m.pooled)
        ]
    return out + [
        f"{_lines([m])}: {m.label} ended {m.outcome.replace('_', ' ')}: it enters no fit, for "
        "that needs readings of the same experiment and simulated runs that end so."
        for m in measured.outcomes
        if m.experiment not in counted
    ]


def untrained(errors: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on the mechanisms that have no emulator, in the table of the emulators' errors, as
    most of their runs gave no value: their models have no effect on the experiment."""
    out = []
    for row in errors:
        if "error" not in row:
            words, name = QUANTITIES[row["experiment"]].words, row["mechanism"].replace("_", " ")
            runs = row["failed"] + row["runs"]
            out.append(
                f"The {words} has no emulator of {name}, as {row['failed']} of its {runs} runs "
                "gave no value: it counts as without effect there."
            )
    return out


def of_outcomes(bulk: Bulk, extended: Sequence[str] = ()) -> list[dict[str, Any]]:
    """[{experiment, levers, tests, failed, before, after}] of the conditions whose tests ended
    without a value or with one: the chance of none by the base model, and by the extended one or
    null."""
    models = {"before": bulk.fit(())} | ({"after": bulk.fit(extended)} if extended else {})
    chance = {
        label: expit(model.odds(fitted.theta[:1], slope=False)[0][0])
        for label, (model, fitted) in models.items()
    }
    rows = []
    for i, (experiment, levers) in enumerate(bulk.tests):
        row = {"experiment": experiment, "levers": levers, "tests": int(bulk.data.tests[i])}  # type: ignore[index]
        row["failed"] = int(bulk.data.failed[0, i])  # type: ignore[index]
        row |= {k: float(chance[k][i]) if k in chance else None for k in ("before", "after")}
        rows.append(row)
    return rows


def _few_levels(kind, own):
    words = QUANTITIES[kind].words
    levels = {name: {m.levers[name] for m in own if name in m.levers} for name in levers_of(kind)}
    if max((len(v) for v in levels.values()), default=0) < 2:
        return [
            f"{_lines(own)}: the {words} was read at a single level of every lever: its own "
            "coefficient meets it, whatever else is missing."
        ]
    return [
        f"{_lines(own)}: the {words} was read at two levels of the {LEVERS[name].words}: two "
        "points are no curve, and only that it changes can be told."
        for name, found in levels.items()
        if len(found) == 2
    ]


def _alone(name, own):
    labels = [getattr(m, name) for m in own]
    return [
        f"{_lines([m])}: {name} {label} has no other row: its error is not told from that of the "
        "setting."
        for m, label in zip(own, labels, strict=True)
        if label and labels.count(label) == 1
    ]


def _lines(rows):
    lines = [str(m.line) for m in rows if m.line is not None]
    return f"Line{'s' * (len(lines) > 1)} {', '.join(lines)}" if lines else "A setting"
