"""Which measured conditions a run is compared with: those at whose levers it is made."""

import math
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement, Measurements
from calibration.intake.quantities import LEVERS
from calibration.statistics.validate import Stated
from dem.spec import RunSpec


class NotComparableError(ConfigError):
    """What was measured is no sample of the run that is simulated: another setting, or several
    means of one. A calibration cannot use it; a diagnosis can, which simulates each row's own
    setting."""


def agreeing(
    table: Measurements, experiment: str, quantity: str, spec: RunSpec, but: Collection[str] = ()
) -> list[Measurement]:
    """The conditions of a quantity that a run of `spec` (a `RunSpec`) is at; levers in `but` do not
    count. Raises ConfigError where the table has no row of it, and NotComparableError where all of
    them are at other settings, naming what differs."""
    found = table.of(experiment, quantity)
    if not found:
        raise ConfigError(
            "has no row of what is asked for",
            path=table.path,
            allowed=f"a row with experiment {experiment} and quantity {quantity}",
        )
    differing = [apart(m, spec, but) for m in found]
    own = [m for m, why in zip(found, differing, strict=True) if why is None]
    if not own:
        name, simulated = differing[0] or ("", 0.0)  # none agrees
        raise NotComparableError(
            f"was measured at another setting than is simulated, {simulated:g}",
            path=table.path,
            line=found[0].line,
            column=name,
            value=found[0].levers[name],
            allowed="a row at the setting that is simulated, or an empty cell",
        )
    return own


def apart(
    measured: Measurement, spec: RunSpec, but: Collection[str] = ()
) -> tuple[str, float] | None:
    """(lever, simulated value) of the first lever at which a run differs, None where none does;
    those in `but` do not count."""
    for name, value in measured.levers.items():
        place = LEVERS[name].place
        if place is None or name in but:
            continue
        simulated = getattr(getattr(spec, place[0]), place[1], None)
        if simulated is not None and not math.isclose(simulated, value, rel_tol=1e-9):
            return name, simulated
    return None


def sample(conditions: Sequence[Measurement], path: str | Path) -> np.ndarray | Stated:
    """All readings (n,) of conditions as one array, or the `Stated` mean of the only one. Raises
    NotComparableError for several means, and ConfigError where nothing is known of the spread."""
    if all(m.readings for m in conditions):
        values = np.array([v for m in conditions for v in m.readings])
        if len(values) < 2:
            raise ConfigError(
                "needs at least two values to have a spread", path=path, line=conditions[0].line
            )
        return values
    if len(conditions) > 1:
        lines = ", ".join(str(m.line) for m in conditions)
        raise NotComparableError(
            f"holds several means that the same run could be compared with: lines {lines}",
            path=path,
            allowed="one of them, or readings; levers tell them apart",
        )
    (only,) = conditions
    if only.n < 2 or only.sd is None:
        raise ConfigError(
            "needs at least two values to have a spread", path=path, line=only.line, column="n"
        )
    return Stated(only.value, only.sd, only.n)
