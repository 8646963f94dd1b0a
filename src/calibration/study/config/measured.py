"""What a study is calibrated to: its measured values, which of them a run is compared with, and
what is asked of each response."""

import math
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement, Measurements, read_measured
from calibration.intake.quantities import LEVERS
from calibration.intake.tables import summary
from calibration.statistics.equivalence import Stated
from calibration.study.config.schema import Config
from calibration.study.config.tests import spec_of
from dem.spec import RunSpec
from dem.units import behind, unit_of, without_unit


def read_target(config: Config) -> np.ndarray | Stated:
    """(n,) readings of the target in its unit; a `Stated` mean where the table holds nothing else.
    Raises ConfigError."""
    return sample(read_swept(config, config.own, config.target), config.measurements)


def rows_of(
    config: Config, table: Measurements, name: str, metric: str, but: Collection[str] = ()
) -> list[Measurement]:
    """The measured conditions of a metric that a test is at; levers in `but` do not count. Raises
    ConfigError where the table has no row of it, and NotComparableError where all of them are at
    other settings, naming what differs."""
    experiment, quantity = config.tests[name].experiment, without_unit(metric)
    found = [m for m in table.of(experiment, quantity) if m.test in ("", name)]
    if not found:
        raise ConfigError(
            "has no row of what is asked for", path=table.path,
            allowed=f"a row with experiment {experiment} and quantity {quantity}",
        )  # fmt: skip
    spec = spec_of(config, name)
    differing = [apart(m, spec, but) for m in found]
    own = [m for m, why in zip(found, differing, strict=True) if why is None]
    if not own:
        lever, simulated = differing[0] or ("", 0.0)  # none agrees
        raise NotComparableError(
            f"was measured at another setting than is simulated, {simulated:g}", path=table.path,
            line=found[0].line, column=lever, value=found[0].levers[lever],
            allowed="a row at the setting that is simulated, or an empty cell",
        )  # fmt: skip
    return own


def is_measured(config: Config) -> bool:
    """Return whether the table of measurements holds the quantity of the target. Raises
    ConfigError."""
    table = read_measured(config.measurements)
    return bool(table.of(config.experiment, without_unit(config.target)))


def read_swept(
    config: Config, name: str, metric: str, but: Collection[str] = ()
) -> list[Measurement]:
    """`rows_of` a test in the table of measurements. Raises ConfigError."""
    return rows_of(config, read_measured(config.measurements), name, metric, but)


def read_back(config: Config) -> list[str]:
    """A sentence on what was read of the target, where it was measured. Raises ConfigError."""
    table, name = read_measured(config.measurements), without_unit(config.target)
    if not table.of(config.experiment, name):
        return []
    try:
        values, unit = read_target(config), behind(unit_of(config.target))
        said = summary(values, unit, table.how) if isinstance(values, np.ndarray) else (
            f"{values.value:g}{unit} ± {values.sd:.2g}{unit} (sd), mean of {values.n} {values.of} "
            f"({table.how})"
        )  # fmt: skip
    except NotComparableError as error:
        said = f"no calibration can use it, only a diagnosis ({error})"
    return [f"{table.path}, {name}: {said}"]


class NotComparableError(ConfigError):
    """What was measured is no sample of the run that is simulated, but of another setting. A
    calibration cannot use it; a diagnosis can, which simulates each row's own setting."""


class SingleError(NotComparableError):
    """One reading with its spread: a posterior can use it, and no comparison of samples."""


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
    """All readings (n,) of conditions as one array, or their `pooled` mean where batches differ or
    the table holds means. Raises ConfigError where nothing is known of the spread."""
    first, mean = conditions[0], pooled(conditions)
    if mean.n < 2:
        raise (ConfigError if first.sd is None else SingleError)(
            "needs at least two values to have a spread", path=path, line=first.line, column="n"
        )
    singly = all(m.n == 1 for m in conditions)
    if all(m.readings for m in conditions) and (singly or mean.of == "values"):
        return np.array([v for m in conditions for v in m.readings])
    return mean


def pooled(conditions: Sequence[Measurement]) -> Stated:
    """`Stated` mean of conditions that one run stands for: of all their values, or of the means of
    batches, where these scatter more than values within a batch make them: readings of a day are no
    further days (the unit of analysis: Fisher 1935, The Design of Experiments). The spread is NaN
    where nothing tells it."""
    means, n = np.array([(m.value, m.n) for m in conditions], float).T
    sd = np.array([math.nan if m.sd is None else m.sd for m in conditions])
    if len(means) == 1:
        return Stated(float(means[0]), float(sd[0]), int(n[0]))
    behind = np.maximum(n - 1, ~np.isnan(sd))  # a spread that is stated counts once
    own, freedom = np.nansum(behind * sd**2), behind.sum()
    between = means.var(ddof=1)
    if between > own / max(freedom, 1) * np.mean(1.0 / n):
        return Stated(float(means.mean()), float(np.sqrt(between)), len(means), "batches")
    mean = n @ means / n.sum()
    if n.max() > 1:  # of single readings the stated spread is all that is known
        own, freedom = own + n @ (means - mean) ** 2, freedom + len(means) - 1
    spread = math.sqrt(own / freedom) if freedom else math.nan
    return Stated(float(mean), spread, int(n.sum()))
