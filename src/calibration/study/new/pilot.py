"""Coarse heaps at the points of a study's screening: which stand, which ranges hold them, what
the study will take."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.statistics.screening_design import screening_design
from calibration.study.config import overlay, point_spec
from calibration.study.stages import expected_runs
from dem.errors import DemError, MeasureError, StoppedError
from dem.spec import parse_spec

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.factors import Factor


COARSE = 1250  # grains
WIDE_ENOUGH = 5.0  # grains across the orifice
ROUNDS = 2  # of moving ends of ranges
MOVE = 0.2  # of a range, by which an end moves in a round
MOST = 0.4  # of a range, that an end moves in all rounds: the middle stays inside
FURTHER = 2  # rounds more where over a quarter of the heaps still does not stand
TELLING = 0.25  # more of the heaps at an end than at the other do not stand, where it moves then


@dataclass(frozen=True)
class Trial:
    """One coarse heap: its point in the unit cube, and why it does not stand (empty where it
    does)."""

    point: tuple
    angle_deg: float | None
    fault: str
    seconds: float

    @property
    def found(self) -> str:
        """The angle, or why there is none, in words."""
        return self.fault or f"{self.angle_deg:.1f}°"


def corners(config: Config, factors: Sequence[Factor]) -> np.ndarray:
    """The distinct points of the study's screening in the unit cube (n, factors): what has to stand
    for the study to go on."""
    coded = screening_design(factors, config.screening)[[f.code for f in factors]]
    return 0.5 * (coded.drop_duplicates().to_numpy(float) + 1.0)


def pilot(
    config: Config,
    factors: Sequence[Factor],
    points: np.ndarray | Sequence[Sequence[float]],
    show: Callable[[str], object] = lambda text: None,
) -> list[Trial]:
    """[Trial] of a coarse heap at each of `points` (n, factors) of the ranges' unit cube."""
    trials = []
    for k, point in enumerate(points, 1):
        trial = one_heap(config, config.run, levels_at(factors, point), tuple(point))
        show(f"heap {k} of {len(points)}: {trial.found} ({trial.seconds:.0f} s)")
        trials.append(trial)
    return trials


def levels_at(factors: Sequence[Factor], point: np.ndarray | Sequence[float]) -> dict[str, float]:
    """Natural levels {key: value} of a point of the ranges' unit cube. point: (factors,) in [0,
    1]."""
    return {
        f.key: round(f.low + x * (f.high - f.low), 6) for f, x in zip(factors, point, strict=True)
    }


def coarse(run: Mapping[str, Any]) -> dict[str, Any]:
    """The run spec with at most COARSE grains of the same volume together, as far as the orifice
    passes them."""
    particles = run["particles"]
    count, sizes = particles["count"], particles.get("sizes")
    if count <= COARSE or sizes:
        return overlay(run, {"particles": {"count": min(count, COARSE)}})
    largest = run["geometry"]["orifice_diameter_mm"] / WIDE_ENOUGH
    diameter = particles["diameter_mm"]
    grown = max(min(diameter * (count / COARSE) ** (1 / 3), largest), diameter)
    fewer = round(count * (diameter / grown) ** 3)
    rate = run["geometry"].get("generation_rate_per_s", count) * fewer / count
    changes = {"particles": {"count": fewer, "diameter_mm": grown}}
    return overlay(run, changes | {"geometry": {"generation_rate_per_s": rate}})


def one_heap(
    config: Config,
    run_spec: Mapping[str, Any],
    levels: Mapping[str, float],
    point: tuple[float, ...],
) -> Trial:
    """`Trial` of a coarse heap of a run spec, which may be another than the configuration's, at
    levels {key: value}."""
    from dem.run import run  # compiles the engine

    spec = parse_spec(point_spec(coarse(run_spec), config.experiment, levels, config.seed))
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = run(spec, Path(folder) / "run")
        except StoppedError:
            raise  # whoever ends the pilot does not ask about this heap
        except MeasureError:
            return Trial(point, None, "no heap: the grains roll off", 0.0)
        except DemError as error:
            return Trial(point, None, str(error), 0.0)
    metrics, numerics = result["metrics"], result["numerics"]
    left = metrics.get("in_funnel", 0)
    fault = f"clogged: {left} grains left in the funnel" if left else ""
    angle = metrics.get("angle_of_repose_deg")
    return Trial(point, angle, fault, numerics["wall_time_s"])


def shrunk(
    factors: Sequence[Factor],
    trials: list[Trial],
    pour: Callable[[list[Factor], list[tuple]], list[Trial]],
) -> tuple[list[Factor], list[Trial]]:
    """(factors, trials) after the ends at which heaps do not stand have moved in: heaps that failed
    are poured again at the new ends, in at most ROUNDS rounds, and FURTHER ones where that is not
    enough. Where none stands nothing moves.

    pour(factors, points) -> [Trial].
    """
    cut = np.zeros((len(factors), 2))
    for turn in range(ROUNDS + FURTHER):
        failed = [k for k, t in enumerate(trials) if t.fault]
        if not failed or len(failed) == len(trials):
            break
        if turn >= ROUNDS and len(failed) <= len(trials) / 4:
            break
        ends = _shared_ends(trials, failed) if turn < ROUNDS else _telling_ends(trials)
        ends = [end for end in ends if cut[end] < MOST]
        if not ends:
            break
        for end in ends:
            cut[end] += MOVE
        points = [trials[k].point for k in failed]
        again = pour(_cut_all(factors, cut), points)
        trials = list(trials)
        for k, trial in zip(failed, again, strict=True):
            trials[k] = trial
    return _cut_all(factors, cut), trials


def _shared_ends(trials, failed):
    """(factor, side) of the ends at which the failed corners lie more often than by chance: all of
    them where any end is shared by all, else those shared by most."""
    points = np.array([trials[k].point for k in failed])
    shares = np.stack([(points == 0.0).mean(axis=0), (points == 1.0).mean(axis=0)], axis=1)
    return list(zip(*np.nonzero(shares >= shares.max()), strict=True))


def _telling_ends(trials):
    """(factor, side) of the ends at which by TELLING more of the heaps do not stand than at the
    other end."""
    points, failed = np.array([t.point for t in trials]), np.array([bool(t.fault) for t in trials])
    ends = []
    for j, at in enumerate(points.T):
        low, high = failed[at == 0.0].mean(), failed[at == 1.0].mean()
        if abs(high - low) >= TELLING:
            ends.append((j, int(high > low)))
    return ends


def _cut_all(factors, cut):
    return [_cut(f, a, 1.0 - b) for f, (a, b) in zip(factors, cut, strict=True)]


def _cut(factor, a, b):
    if (a, b) == (0.0, 1.0):
        return factor
    span = factor.high - factor.low
    return narrowed(factor, round(factor.low + a * span, 4), round(factor.low + b * span, 4))


def narrowed(factor: Factor, low: float, high: float) -> Factor:
    """A factor of a narrower range, which its description tells."""
    note = f"{factor.description}; cut from {factor.low:g} to {factor.high:g} by the pilot"
    return replace(factor, low=low, high=high, description=note)


def advice(trials: Sequence[Trial], measured: float | None = None) -> list[str]:
    """Sentences on what the heaps that do not stand ask for, and on whether those that do reach the
    measured angle [deg]."""
    rolled = sum("no heap" in t.fault for t in trials)
    clogged = sum("clogged" in t.fault for t in trials)
    found = [f"{sum(not t.fault for t in trials)} of {len(trials)} coarse heaps stand"]
    angles = [t.angle_deg for t in trials if not t.fault and t.angle_deg is not None]
    if angles and measured is not None:
        found.append(_reach(min(angles), max(angles), measured))
    if rolled > len(trials) / 4:
        found.append(
            f"{rolled} rolled off: a plate with a rim (--rim, geometry.plate_rim_height_mm) or a "
            f"lower orifice (--height) keeps them; is your own plate bare?"
        )
    if clogged:
        found.append(f"{clogged} clogged: a wider orifice, or a lifted cylinder in the laboratory")
    return found


def _reach(low, high, measured):
    found = f"their angles are {low:.1f}° to {high:.1f}°; yours is {measured:.1f}°"
    if low <= measured <= high:
        return found
    if measured > high:
        return f"{found}: {measured - high:.1f}° steeper than all of them"
    return (
        f"{found}: {low - measured:.1f}° flatter than all of them. Less friction between grains or "
        f"a rounder grain (particles.elongation) would be flatter"
    )


def cost(config: Config, trials: Sequence[Trial], cores: int = 2) -> str | None:
    """'63 heaps, 9 minutes': from the pilot's speed and the study's grains and steps; None where
    none ran."""
    ran = [t for t in trials if t.seconds > 0]
    if not ran:
        return None
    full, small = config.run["particles"], coarse(config.run)["particles"]
    finer = small["diameter_mm"] / full["diameter_mm"] if "diameter_mm" in small else 1.0
    # the median: the first heap waited for the compiler
    seconds = np.median([t.seconds for t in ran]) * full["count"] / small["count"] * finer
    heaps = expected_runs(config)
    minutes = heaps * seconds / cores / 60
    said = f"{minutes:.0f} minutes" if minutes >= 1.5 else f"{60 * minutes:.0f} seconds"
    return f"{heaps} heaps, about {said} on {cores} cores"
