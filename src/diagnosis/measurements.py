"""The measured conditions that the diagnosis takes from a study's table."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from calibration.errors import ConfigError
from calibration.intake.measurements import ROLES, raise_faults, read_measured
from calibration.intake.quantities import QUANTITIES
from diagnosis.reading_errors import LABELS, doubt, spread_unit
from diagnosis.table_model.single_readings import one_by_one, set_aside

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
        fitted,
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
    y = np.array([np.log(own[i].value) if unit[i] != 1.0 else own[i].value for i in single])
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
