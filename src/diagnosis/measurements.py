"""The measured conditions that the diagnosis takes from a study's table, and single readings that
contradict the other readings of their own condition.

Where a table holds each reading, one that is far off widens the spread of its condition and hides
there. So the worst reading of each condition is compared with the mean and the spread of its
others, and with what all conditions say of that spread (the deletion residual: Cook and Weisberg
1982, Residuals and Influence in Regression, 2.2.2). Its chance is simulated.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import ConfigError
from calibration.intake.measurements import ROLES, Measurement, raise_faults, read_measured
from calibration.intake.quantities import QUANTITIES
from diagnosis.chance import share_above
from diagnosis.laws.readings import step_of
from diagnosis.page.words import told
from diagnosis.reading_errors import LABELS, doubt, spread_unit, stated_sd

WITHIN = 0.01
"""Chance of how readings go with something within their settings, over all that is looked at, below
which they are taken one by one."""

LEAST_WITHIN = 8  # readings beyond one a setting, for that to be looked at
PERMUTATIONS = 1999
LEAST = 4  # readings of a condition
FAR = 4.0  # standard deviations: nearer, no chance is below OUT
OUT = 0.001
"""Chance of a reading so far off, over all conditions of an experiment, below which it is left
out."""

DRAWS = 9999


def one_by_one(
    measurements: Sequence[Measurement],
) -> tuple[list[Measurement], dict[str, dict[str, Any]]]:
    """The measurements, those of an experiment whose readings go with the order of the rows or with
    a recorded number within their settings as one of each reading; and {experiment: {of, p}} of
    these.

    Within settings the readings are permuted (Fisher 1935, The Design of Experiments). Their
    common spread is that which is left beside a straight line over what they go with most."""
    out, told = list(measurements), {}
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [m for m in out if m.experiment == kind and len(m.lines) == len(m.readings) > 1]
        alike = all(len({*m.readings}) == 1 for m in own)
        if alike or sum(m.n - 1 for m in own) < LEAST_WITHIN:
            continue
        found = _within(own)
        if found["p"] >= WITHIN:
            continue
        told[kind] = {"of": found["of"], "p": found["p"]}
        out = [one for m in out for one in (_singles(m, found["sd"]) if m in own else [m])]
    # the order of the rows is that of the tests
    return sorted(out, key=lambda m: m.line or 0), told


def _within(own):
    """{of, p, sd}: what readings go with most within their settings, its chance over all that was
    looked at, and the spread that a line over it leaves, in `spread_unit`."""
    groups = np.repeat(np.arange(len(own)), [m.n for m in own])
    off = np.concatenate([(np.array(m.readings) - m.value) / u
                          for m, u in zip(own, spread_unit(own), strict=True)])  # fmt: skip
    columns = {
        "order": np.argsort(np.argsort(np.concatenate([m.lines for m in own]))).astype(float)
    }
    for name in dict.fromkeys(n for m in own for n in m.pooled):
        read = [m.pooled.get(name, (m.covariates.get(name),) * m.n) for m in own]
        if all(len(v) == m.n and None not in v for v, m in zip(read, own, strict=True)):
            columns[name] = np.concatenate(read)
    x = np.array([c - np.array([c[groups == g].mean() for g in groups]) for c in columns.values()])
    x /= np.sqrt((x**2).sum(1, keepdims=True))
    rng, size = np.random.default_rng([0, 31]), np.sqrt((off**2).sum())
    places = [np.flatnonzero(groups == g) for g in range(len(own))]
    drawn = np.empty((PERMUTATIONS, len(off)))
    for index in places:
        drawn[:, index] = rng.permuted(np.tile(off[index], (PERMUTATIONS, 1)), axis=1)
    seen, null = np.abs(x @ off) / size, np.abs(drawn @ x.T).max(1) / size
    best = int(seen.argmax())
    left = np.sqrt((off**2).sum() * (1.0 - seen[best] ** 2) / (len(off) - len(own) - 1))
    return {"of": [*columns][best], "p": share_above(null, float(seen[best])), "sd": float(left)}


def _singles(m, spread):
    """A measurement of each reading."""
    for k, (value, line) in enumerate(zip(m.readings, m.lines, strict=True)):
        more = {name: values[k] for name, values in m.pooled.items()}
        sd = spread * float(spread_unit([m])[0])
        yield replace(
            m, value=value, sd=sd, n=1, line=line, readings=(value,), lines=(line,), pooled={},
            covariates=m.covariates | more,
        )  # fmt: skip


def rounded(measurements: Sequence[Measurement]) -> list[Measurement]:
    """The measurements, no spread of replicates below what rounding to the step of their experiment
    takes off: readings that were rounded to one value do not know it."""
    kinds = {m.experiment for m in measurements}
    steps = {k: step_of([m for m in measurements if m.experiment == k]) or 0.0 for k in kinds}
    return [
        m if m.n < 2 else replace(m, sd=max(m.sd, steps[m.experiment] / np.sqrt(12.0)))
        for m in measurements
    ]


def set_aside(
    measurements: Sequence[Measurement],
) -> tuple[list[Measurement], list[dict[str, Any]]]:
    """The measurements without such readings, and rows of verdict.json that point at them."""
    kept, rows = list(measurements), []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        at = [i for i, m in enumerate(measurements)
              if m.experiment == kind and len(m.readings) >= LEAST]  # fmt: skip
        own = [measurements[i] for i in at]
        unit = spread_unit(own)
        readings = [np.array([m.readings]) / u for m, u in zip(own, unit, strict=True)]
        steps = [d for r in readings for d in np.diff(np.sort(r[0])) if d > 0.0]
        if len(own) < 2 or not steps:
            continue
        places, [distance] = _worst(own, readings, min(steps))
        if np.abs(distance).max() < FAR:
            continue
        rest = [_without(m, place[0]) for m, place in zip(own, places, strict=True)]
        rng, spread = np.random.default_rng([0, 37]), stated_sd(rest) / unit
        drawn = [s * rng.standard_normal((DRAWS, m.n)) for m, s in zip(own, spread, strict=True)]
        null = np.abs(_worst(own, drawn)[1]).max(1)
        for i, m, without, place, far in zip(at, own, rest, places, distance, strict=True):
            if share_above(null, abs(far)) < OUT:
                kept[i] = without
                rows.append(_row(m, place[0], far))
    return kept, rows


def _worst(own, readings, step=0.0):
    """(k,) places (draws,) of the reading of each condition that lies farthest from its median, and
    (draws, k) how many standard deviations that is from the mean of the others; readings: [(draws,
    n)] of each condition, in `spread_unit`, which were read in steps of `step`."""
    places, off, spread = [], [], []
    for r in readings:
        r = r - np.median(r, axis=1, keepdims=True)
        place, n = np.abs(r).argmax(1), r.shape[1] - 1
        rest = r[np.arange(r.shape[1]) != place[:, None]].reshape(len(r), n)
        worst = np.take_along_axis(r, place[:, None], 1)[:, 0]
        places.append(place)
        off.append((worst - rest.mean(1)) / np.sqrt(1.0 + 1.0 / n))
        spread.append(np.maximum(rest.std(1, ddof=1), step / np.sqrt(12.0)))
    unit, fewer = spread_unit(own), [replace(m, n=m.n - 1) for m in own]
    told = stated_sd(fewer, np.array(spread).T * unit) / unit
    return places, np.array(off).T / told


def _without(m, place):
    values = tuple(v for k, v in enumerate(m.readings) if k != place)
    sd = max(stdev(values), 1e-9 * abs(values[0]))
    lines = tuple(v for k, v in enumerate(m.lines) if k != place)
    return replace(m, value=fmean(values), sd=sd, n=len(values), readings=values, lines=lines)


def _row(m, place, off):
    line = m.lines[place] if m.lines else m.line
    row = {"experiment": m.experiment, "line": line, "levers": m.levers}
    row |= {"value": float(m.readings[place]), "standard_deviations": float(off)}
    row |= {"expected": float(np.median(m.readings)), "setting": None, "reads_like": None}
    return row | {"sentence": told("left_out.j2", row=row)}


CONTACTS = ("drop", "tilt")
"""Experiments that are one contact, which is integrated and not emulated."""

LEAST_CONDITIONS = 3
LEAST_SETTINGS = 5
"""Settings of the experiments that a cause shows on, for it to be named. With fewer the errors
between settings cannot be known, and a day of another humidity looks like a law."""


@dataclass(frozen=True)
class Measured:
    """All rows of a table: conditions to calibrate on, those held out, tests without a value;
    singly: {experiment: {of, p}} of those whose readings are taken one by one; aside: rows of
    verdict.json of single readings far from the others of their condition, which were left out."""

    fitted: list
    held_out: list
    outcomes: list
    singly: dict = field(default_factory=dict)
    aside: list = field(default_factory=list)


def alone(experiments: Iterable[str]) -> bool:
    """Return whether all of the experiments are single contacts."""
    return set(experiments) <= set(CONTACTS)


def need_emulators(path: str | Path) -> bool:
    """Return whether a table has rows of other experiments than single contacts. A faulty one
    counts as having them: who reads it says what is wrong."""
    try:
        return not alone(m.experiment for m in read_all(path).fitted)
    except (ConfigError, OSError):
        return True


def read_all(path: str | Path) -> Measured:
    """`Measured` of the quantities that the diagnosis knows. Raises ConfigError naming file, line
    and column of every fault, one message a fault."""
    rows = read_measured(path, apart=True).conditions
    rows = [m for m in rows if m.quantity == QUANTITIES[m.experiment].name]
    valued = _with_spread([r for r in rows if not r.outcome], path)
    kept, aside = set_aside([r for r in valued if r.role == ROLES[0]])
    fitted, singly = one_by_one(kept)
    out = Measured(
        rounded(fitted),
        [r for r in valued if r.role != ROLES[0]],
        [r for r in rows if r.outcome and r.role == ROLES[0]],
        singly,
        aside,
    )
    _enough(out.fitted, path)
    return out


def _with_spread(measurements, path):
    """The measurements, a reading that is alone in its condition with the spread that the others of
    its experiment tell. Raises ConfigError for those of which none tells it."""
    told = {m.experiment: None for m in measurements if m.sd is None}
    for kind in told:
        told[kind] = _common_spread([m for m in measurements if m.experiment == kind])
    faults = [
        ConfigError(
            "is the only one of its condition, and no other reading tells its spread",
            path=path,
            line=m.line,
            column="replicate" if m.replicate else "sd",
            allowed="two readings or more of a condition, or of settings in several batches or "
            "by several instruments, or one row with sd and n",
        )
        for m in measurements
        if m.sd is None and told[m.experiment] is None
    ]
    raise_faults(faults)
    return [
        m if m.sd is not None else replace(m, sd=told[m.experiment] * unit, lines=(m.line,))
        for m, unit in zip(measurements, spread_unit(measurements), strict=True)
    ]


def _common_spread(own):
    """Standard deviation of a reading of an experiment in `spread_unit`, its doubt with it; None
    where nothing tells it. Replicates tell it, and single readings of a setting in several batches
    or by several instruments, beside a level of each setting and what each of these adds."""
    unit = spread_unit(own)
    freedom = sum(m.n - 1 for m in own if m.sd is not None)
    squares = sum((m.n - 1) * (m.sd / u) ** 2 for m, u in zip(own, unit, strict=True) if m.sd)
    single = [i for i, m in enumerate(own) if m.sd is None]
    y = np.array([own[i].value for i in single])
    y = np.log(y) if QUANTITIES[own[0].experiment].relative else y
    added = pd.DataFrame(
        [{"setting": str(own[i].levers)} | {n: getattr(own[i], n) for n in LABELS} for i in single]
    )
    levels = pd.get_dummies(added).to_numpy(float)
    level, _, rank, _ = np.linalg.lstsq(levels, y)
    freedom += len(y) - rank
    squares += ((y - levels @ level) ** 2).sum()
    return float(doubt(freedom) * np.sqrt(squares / freedom)) if freedom > 0 else None


def _enough(measurements, path):
    """Raise ConfigError where no data could tell one mechanism from another."""
    if len(measurements) < LEAST_CONDITIONS:
        raise ConfigError(
            "has too few conditions to tell anything apart",
            path=path,
            value=len(measurements),
            allowed=f"at least {LEAST_CONDITIONS} rows",
        )
    for kind in {m.experiment for m in measurements}:
        own = [m.levers | m.covariates for m in measurements if m.experiment == kind]
        if any(len({m.get(name) for m in own}) > 1 for m in own[:1] for name in m):
            return
    raise ConfigError(
        "has no experiment at two settings of a lever: a single setting is met by the parameters "
        "alone",
        path=path,
        allowed="two rows or more of an experiment that differ in a lever or in what was recorded",
    )
