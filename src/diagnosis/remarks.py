"""Remarks on what the settings of a table cannot tell, and its tests that ended without a value."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from scipy.special import expit

from calibration.intake.quantities import levers_of
from diagnosis.bulk import Bulk
from diagnosis.measurements import Measured
from diagnosis.page import words


def remarks(
    measured: Measured,
    counted: Collection[str] = (),
    errors: Sequence[Mapping[str, Any]] = (),
) -> list[str]:
    """Sentences, each with its lines, on what a `Measured` table cannot tell; counted: experiments
    whose tests without a value entered the fits; errors: of the emulators, of which a mechanism has
    none where most of its runs gave no value."""
    kinds = [
        _Kind(kind, [m for m in measured.fitted if m.experiment == kind], measured.singly.get(kind))
        for kind in dict.fromkeys(m.experiment for m in measured.fitted)
    ]
    text = words.environment().get_template("remarks.j2").render(
        kinds=kinds,
        outcomes=[m for m in measured.outcomes if m.experiment not in counted],
        untrained=[row for row in errors if "error" not in row],
        lines=_lines,
    )  # fmt: skip
    return [line for line in text.splitlines() if line]


class _Kind:
    """An experiment's measurements, levels of its levers, rows whose batch or instrument is alone,
    readings that are alone in their condition, columns that differ within a setting, and what its
    readings go with."""

    def __init__(self, kind, own, goes_with):
        self.kind, self.own, self.goes_with = kind, own, goes_with
        count = {n: len({m.levers[n] for m in own if n in m.levers}) for n in levers_of(kind)}
        self.single = max(count.values(), default=0) < 2
        self.two = [name for name, levels in count.items() if levels == 2]
        self.alone = [(name, m) for name in ("batch", "instrument") for m in own if getattr(m, name)
                      and sum(getattr(o, name) == getattr(m, name) for o in own) == 1]  # fmt: skip
        self.lone = [m for m in own if len(m.readings) == 1 and not goes_with]
        self.pooled = {name: [m for m in own if name in m.pooled]
                       for name in dict.fromkeys(n for m in own for n in m.pooled)}  # fmt: skip


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


def _lines(rows):
    lines = [str(m.line) for m in rows if m.line is not None]
    return f"Line{'s' * (len(lines) > 1)} {', '.join(lines)}" if lines else "A setting"
