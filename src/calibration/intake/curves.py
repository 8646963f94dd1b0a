"""Curves as targets: each measured curve becomes a few coefficients of its shape, read as a run
reads its own, and repeated curves give their covariance.

A shape is a row of `SHAPES`. The points of one curve are no independent readings: what scatters is
the test, so the covariance is that of whole curves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from calibration.intake.tables import read_table, refused
from dem.linear import slope
from dem.measure.heap import fit_flank
from dem.units import UnitError, in_unit

COLUMNS = ("curve", "x", "y")
LEAST_POINTS = 8
EVEN = 200
"""Points of equal distance that a path is interpolated to."""
UPPER_LOAD = 0.3
"""Share of the load from which on a compression's modulus is read, as a run reads it."""


@dataclass(frozen=True)
class Shape:
    """Coefficients of a curve y(x).

    words: for the reference; x, y: their units; metrics: of the runs, which the coefficients are
    called by; read: read(x, y) -> coefficients (q,) of points (m,) in the order of x. A curve over
    a setting of the rig has its key in the rig's `geometry`: its coefficients are the values at the
    settings (q,) that are simulated, read(x, y, settings), and its one metric counts for each.
    """

    words: str
    x: str
    y: str
    metrics: tuple
    read: Callable
    setting: str | None = None

    @property
    def least_points(self) -> int:
        """Points that a curve needs; settings are few."""
        return 2 if self.setting else LEAST_POINTS


def _discharge(time, mass):
    with np.errstate(divide="ignore", invalid="ignore"):  # what is not finite is refused
        # loads the engine, for which no start waits
        from dem.experiments.outflow import ended, steady_flow

        return steady_flow(time, mass), ended(time, mass)


def _shear(path, stress):
    even = np.interp(np.linspace(path[0], path[-1], EVEN), path, stress)
    smooth = sliding_window_view(even, EVEN // 10).mean(axis=1)
    return smooth.max(), even[EVEN // 2 :].mean()


def _compression(stress, strain):
    upper = (stress > UPPER_LOAD * stress[-1]) & (strain > 0.0)
    return strain[-1], slope(strain[upper], stress[upper])


def _outline(across, height):
    """Mean angle of both flanks, and the height; the middle is that of the outline's base."""
    top = height.max()
    middle = 0.5 * (across[height > 0.1 * top][0] + across[height > 0.1 * top][-1])
    angles = []
    for side in (-1.0, 1.0):
        distance = side * (across - middle)
        own = np.argsort(distance[distance >= 0.0], kind="stable")
        profile = height[distance >= 0.0][own]
        angles.append(fit_flank(distance[distance >= 0.0][own], profile, np.inf))
    return np.mean(angles), top


def _at(x, y, settings):
    """Values at settings, in straight lines between points; nan where the curve does not reach."""
    return np.interp(settings, x, y, left=np.nan, right=np.nan)


SHAPES = {
    "mass over time": Shape(
        "mass that has left over time: steady flow and emptying time",
        "s", "g", ("mass_flow_g_s", "emptying_time_s"), _discharge,
    ),
    "stress over displacement": Shape(
        "shear stress over displacement: peak and steady stress",
        "mm", "kPa", ("shear_stress_kPa", "steady_shear_stress_kPa"), _shear,
    ),
    "strain over stress": Shape(
        "strain over normal stress: strain at the load and modulus near it",
        "kPa", "1", ("strain_at_load", "constrained_modulus_kPa"), _compression,
    ),
    "outline": Shape(
        "height of a heap's outline over the distance across: angle of its flanks and height",
        "mm", "mm", ("angle_of_repose_deg", "height_mm"), _outline,
    ),
    "angle over speed": Shape(
        "angle in a drum over its speed of rotation: the angle at each speed that is simulated",
        "deg/s", "deg", ("dynamic_angle_deg",), _at, setting="rotation_rate_deg_s",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class ShapeMean:
    """Coefficients of measured curves: the metrics' names (q), their mean (q,) and its covariance
    (q, q), with the degrees of freedom behind it."""

    metrics: tuple
    mean: np.ndarray
    covariance: np.ndarray
    freedom: float


def read_curves(path: str | Path, shape: str, settings: Sequence[float] = ()) -> ShapeMean:
    """`ShapeMean` of the curves in a table with the columns `curve` (its name), `x` and `y`.
    settings: (q,) at which a curve over a setting is read.

    Raises ConfigError naming file and line: for an unknown unit, too few points, a curve that has
    no such coefficients, and fewer curves than a covariance needs (one more than coefficients).
    """
    of, table = SHAPES[shape], read_table(path)
    table.require(*COLUMNS)
    factors = [_factor(table, column, unit) for column, unit in (("x", of.x), ("y", of.y))]
    points: dict[str, list[tuple]] = {}
    for line, row in table.rows:
        values = [table.number(line, c, row[c]) * f for c, f in zip("xy", factors, strict=True)]
        points.setdefault(row["curve"], []).append((line, *values))
    found = np.array(
        [_coefficients(of, name, rows, path, settings) for name, rows in points.items()]
    )
    metrics = of.metrics * len(settings) if of.setting else of.metrics
    n, q = len(found), len(metrics)
    if n < q + 1:
        first = next(iter(points.values()))[0][0] if points else None
        facts = {"n": n, "s": "s" * (n != 1), "q": q, "least": q + 1}
        raise refused("few curves", path, line=first, column="curve", **facts)
    covariance = np.atleast_2d(np.cov(found.T)) / n
    return ShapeMean(metrics, found.mean(axis=0), covariance, float(n - q))


def _factor(table, column, unit):
    """Return what a column's numbers are multiplied with; its unit stands in the header, else it is
    the shape's."""
    stated = table.units.get(column, "")
    try:
        return in_unit(f"1 {stated}", None if unit == "1" else unit) if stated else 1.0
    except UnitError:
        where = {"line": table.header_line, "column": column, "value": stated}
        raise refused("curve's unit", table.path, unit=unit, **where) from None


def _coefficients(shape, name, rows, path, settings):
    x, y = np.array([r[1:] for r in rows]).T
    back = np.flatnonzero(np.diff(x) < 0) if not shape.setting else ()
    if len(back):
        line, (first, second) = rows[back[0] + 1][0], x[back[0] : back[0] + 2]
        facts = {"name": name, "first": first, "second": second, "unit": shape.x}
        raise refused("curve goes back", path, line=line, column="x", **facts)
    facts = {"name": name, "points": len(rows), "least": shape.least_points, "words": shape.words}
    facts |= {"line": rows[0][0], "column": "curve"}
    if len(rows) < shape.least_points:
        raise refused("short curve", path, **facts)
    order = np.argsort(x, kind="stable")
    own = (np.asarray(settings, float),) if shape.setting else ()
    found = np.array(shape.read(x[order], y[order], *own), float)
    if not np.isfinite(found).all():
        at = f" at {', '.join(f'{s:g}' for s in settings)} {shape.x}" if settings else ""
        raise refused("no coefficients", path, metrics=" or ".join(shape.metrics), at=at, **facts)
    return found
