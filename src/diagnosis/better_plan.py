"""A plan of as many settings that tells more: D-optimal for a bent curve in each state at once.

Each free law asks for a level, a slope and a bend over the scaled logarithm of its state. The
plan's settings are exchanged one by one (Fedorov 1972, Theory of Optimal Experiments). The new ones
raise the sum over the laws of the logarithms of what is known of slope and bend. Readings at one
level of a lever share an error, as the diagnosis has it, so that repeating a level tells less than
a new one. Settings stay within the plan's own ranges, and a lever that it does not vary is left
alone.
"""

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.statistics.ties import first_largest
from diagnosis.laws.readings import from_log, readings_of
from diagnosis.laws.sizes import TIMES
from diagnosis.laws.slots import applicable, scaled
from diagnosis.page.words import environment

LEVELS = 9
ROUNDS = 4
WEAK = 1e-3  # prior information of slope and bend, over that of one setting
GOLDEN = 0.6180339887498949
SHARED = TIMES[0]  # standard deviation of an error that a level shares, over that of a setting


def plans(
    measurements: Sequence[Measurement], defaults: Mapping[str, Mapping[str, float]] | None = None
) -> list[list[Measurement]]:
    """Lists of `Measurement`, each a plan of as many settings in each experiment: levers chosen,
    values those of the plan's mean coefficient, with its median share of spread. First the
    D-optimal one, then one whose settings all stand at levels of their own."""
    return [
        [m for kind in _kinds(measurements) for m in make(kind, measurements, defaults)]
        for make in (_optimal, _spread)
    ]


def best(
    measurements: list[Measurement],
    power: Callable[[list[Measurement]], list[dict[str, Any]]],
    defaults: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[list[dict[str, Any]], list[Measurement], list[dict[str, Any]]]:
    """(plan, its rows) of the plan that shows more than the others and the given one, or ([], [])
    where none does; power: function of measurements, `diagnosis.power.power`.

    A new plan has no batches or instruments yet, so the given one is compared without them too."""
    bare = [replace(m, batch="", instrument="") for m in measurements]
    own, found = power(measurements), ([], [])  # type: ignore[var-annotated]
    least = own if bare == measurements else power(bare)
    for plan in plans(measurements, defaults):
        rows = power(plan)
        if shows_more(least, rows):
            least, found = rows, (plan, rows)
    return own, *found


def _kinds(measurements):
    return list(dict.fromkeys(m.experiment for m in measurements))


def _own(kind, measurements, defaults):
    own = [m for m in measurements if m.experiment == kind]
    return own, readings_of(own, kind, (defaults or {}).get(kind))


def _optimal(kind, measurements, defaults):
    own, readings = _own(kind, measurements, defaults)
    laws = applicable(readings)
    if not laws:
        return own
    start = [tuple(readings.levers[n][i] for n in readings.levers) for i in range(len(own))]
    chosen = exchange(start, _candidates(readings), _informed(laws, readings))
    return [_setting(kind, own, readings, at) for at in chosen]


def _spread(kind, measurements, defaults):
    """Each lever at as many levels as there are settings, evenly over its logarithm, each in an
    order of its own: multiples of the golden ratio's powers (a lattice)."""
    own, readings = _own(kind, measurements, defaults)
    if not applicable(readings):
        return own
    n, columns = len(own), []
    for k, (name, value) in enumerate(readings.levers.items()):
        low, high = np.nanmin(value), np.nanmax(value)
        if name not in readings.folds or low <= 0.0:
            columns.append(value)
            continue
        order = np.argsort(np.arange(n) * GOLDEN**k % 1.0) if k else np.arange(n)
        levels = np.geomspace(low, high, n)[np.argsort(order)]
        columns.append([_rounded(v, low, high) for v in levels])
    return [_setting(kind, own, readings, at) for at in zip(*columns, strict=True)]


def exchange(
    start: list[Any], candidates: Sequence[Any], informed: Callable[[list[Any]], float]
) -> list[Any]:
    """The list of settings that no single exchange improves; informed: settings -> criterion."""
    plan, best = list(start), informed(start)
    for _ in range(ROUNDS):
        before = best
        for i in range(len(plan)):
            tried = [plan[:i] + [c] + plan[i + 1 :] for c in candidates]
            values = [informed(t) for t in tried]
            k = first_largest(values)
            if values[k] > best + 1e-9:
                plan, best = tried[k], values[k]
        if best <= before + 1e-9:
            break
    return plan


def _candidates(readings):
    along = []
    for name, value in readings.levers.items():
        low, high = np.nanmin(value), np.nanmax(value)
        varied = name in readings.folds and low > 0.0
        values = np.geomspace(low, high, LEVELS) if varied else np.unique(value)
        along.append([_rounded(v, low, high) if varied else float(v) for v in values])
    return list(itertools.product(*along))


def _rounded(value, low, high):
    """To three digits, but not beyond the plan's range."""
    return float(min(max(float(f"{value:.3g}"), low), high))


def _informed(laws, readings):
    """A function of settings: the sum over the laws of log det of what is known of their terms."""
    names = list(readings.levers)
    spans = [(law, *scaled(law, readings.levers)[1:]) for law in laws if law.coordinate]

    def value(settings):
        levers = dict(zip(names, np.array(settings).T, strict=True))
        noise = np.eye(len(settings))
        for name in readings.folds:
            noise += SHARED**2 * (levers[name][:, None] == levers[name][None, :])
        precision, total = np.linalg.inv(noise), 0.0
        level = precision.sum(0) / precision.sum()
        for law, middle, half in spans:
            x = (np.log(np.maximum(law.coordinate(levers), 1e-12)) - middle) / max(half, 1e-12)
            terms = np.stack([x, x**2], 1)
            terms = terms - level @ terms
            total += np.linalg.slogdet(terms.T @ precision @ terms + WEAK * np.eye(2))[1]
        return total

    return value


def _setting(kind, own, readings, at):
    levers = {n: v for n, v in zip(readings.levers, at, strict=True) if np.isfinite(v)}
    level = float(np.median(readings.log))
    value = float(
        from_log(kind, np.array([level]), {n: np.array([v]) for n, v in levers.items()})[0]
    )
    share = float(np.median([m.sd / m.value for m in own]))
    n = int(np.median([m.n for m in own]))
    levers = {k: v for k, v in levers.items() if any(k in m.levers for m in own)}
    lever_sd = float(np.median([m.lever_sd for m in own]))
    return Measurement(kind, value, share * value, n, levers, lever_sd=lever_sd)


def shows_more(rows: Sequence[Mapping[str, Any]], better: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a plan shows weaker laws than another, both rows of `diagnosis.power.power`: more of
    them, or as many and weaker ones in the mean of the logarithms."""
    own, other = ({(r["experiment"], r["law"]): r["detectable"] for r in p} for p in (rows, better))
    shown = [{k for k, v in p.items() if v} for p in (own, other)]
    if len(shown[0]) != len(shown[1]):
        return len(shown[1]) > len(shown[0])
    both = shown[0] & shown[1]
    return sum(np.log(abs(other[k] / own[k])) for k in both) < 0.0


def page(measurements: Sequence[Measurement]) -> str:
    """The settings in Markdown, one row for settings that are alike."""
    tables = {}
    for kind in _kinds(measurements):
        own = [m for m in measurements if m.experiment == kind]
        names = list(dict.fromkeys(n for m in own for n in m.levers))
        rows = Counter(tuple(m.levers.get(n, -np.inf) for n in names) for m in own)
        tables[kind] = names, sorted(rows.items())
    template = environment().get_template("better_plan.md.j2")
    return template.render(tables=tables, missing=-np.inf)
