"""A few coarse heaps over the ranges of a study: which stand, which ranges hold them, what the
study will take."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from calibration.config import overlay, point_spec
from calibration.factors import read_factors
from calibration.progress import expected_runs
from dem.errors import DemError, MeasureError, StoppedError
from dem.spec import parse_spec

HEAPS = 8
COARSE = 1250  # grains
WIDE_ENOUGH = 5.0  # grains across the orifice
LEAST_WIDTH = 0.4  # of a range: what a cut leaves at least


@dataclass(frozen=True)
class Trial:
    """One coarse heap: its point in the unit cube, and why it does not stand (empty where it
    does)."""

    point: tuple
    angle_deg: float | None
    fault: str
    work: float
    seconds: float


def pilot(config, heaps=HEAPS, show=lambda text: None):
    """[Trial] of a Latin hypercube of coarse heaps over the factors' ranges."""
    factors = read_factors(config.factors)
    points = qmc.LatinHypercube(len(factors), rng=np.random.default_rng(config.seed)).random(heaps)
    trials = []
    for k, point in enumerate(points, 1):
        levels = {
            f.key: round(f.low + x * (f.high - f.low), 6)
            for f, x in zip(factors, point, strict=True)
        }
        trial = _try(coarse(config.run), config.experiment, levels, config.seed, tuple(point))
        found = trial.fault or f"{trial.angle_deg:.1f}°"
        show(f"heap {k} of {heaps}: {found} ({trial.seconds:.0f} s)")
        trials.append(trial)
    return trials


def coarse(run):
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


def _try(run_spec, experiment, levels, seed, point):
    from dem.run import run  # compiles the engine

    spec = parse_spec(point_spec(run_spec, experiment, levels, seed))
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = run(spec, Path(folder) / "run")
        except StoppedError:
            raise  # whoever ends the pilot does not ask about this heap
        except MeasureError:
            return Trial(point, None, "no heap: the grains roll off", 0.0, 0.0)
        except DemError as error:
            return Trial(point, None, str(error), 0.0, 0.0)
    metrics, numerics = result["metrics"], result["numerics"]
    left = metrics.get("in_funnel", 0)
    fault = f"clogged: {left} grains left in the funnel" if left else ""
    work = spec.particles.count * numerics["steps"]
    angle = metrics.get("angle_of_repose_deg")
    return Trial(point, angle, fault, work, numerics["wall_time_s"])


def shrunk(factors, trials):
    """Factors with ranges cut to where heaps stand: the cuts that leave out most faults and fewest
    heaps."""
    points = np.array([t.point for t in trials])
    stands = np.array([not t.fault for t in trials])
    low, high = np.zeros(points.shape[1]), np.ones(points.shape[1])
    while stands.any():
        inside = ((points >= low) & (points <= high)).all(axis=1)
        if not (inside & ~stands).any():
            break
        gain, j, side, at = max(_cuts(points, stands, inside, low, high), default=(0, 0, 0, 0.0))
        if gain <= 0:
            break
        (low if side == 0 else high)[j] = at
    return [_cut(f, a, b) for f, a, b in zip(factors, low, high, strict=True)]


def _cuts(points, stands, inside, low, high):
    """(gain, factor, side, place) of the cuts between neighbouring points: faults less twice the
    heaps left out."""
    for j in range(points.shape[1]):
        levels = np.sort(points[inside, j])
        for at in 0.5 * (levels[1:] + levels[:-1]):
            for side, out in ((0, points[:, j] < at), (1, points[:, j] > at)):
                width = high[j] - at if side == 0 else at - low[j]
                if width >= LEAST_WIDTH:
                    gone = inside & out
                    yield int((gone & ~stands).sum() - 2 * (gone & stands).sum()), j, side, at


def _cut(factor, a, b):
    if (a, b) == (0.0, 1.0):
        return factor
    span = factor.high - factor.low
    low, high = round(factor.low + a * span, 4), round(factor.low + b * span, 4)
    note = f"{factor.description}; cut from {factor.low:g} to {factor.high:g} by the pilot"
    return replace(factor, low=low, high=high, description=note)


def advice(trials):
    """Sentences on what the heaps that do not stand ask for."""
    rolled = sum("no heap" in t.fault for t in trials)
    clogged = sum("clogged" in t.fault for t in trials)
    found = [f"{sum(not t.fault for t in trials)} of {len(trials)} coarse heaps stand"]
    if rolled > len(trials) / 4:
        found.append(
            f"{rolled} rolled off: a plate with a rim (geometry.plate_stl, docs/howto-geometry.md) "
            f"or a "
            "lower discharge_height_mm keeps them; is your own plate bare?"
        )
    if clogged:
        found.append(f"{clogged} clogged: a wider orifice, or a lifted cylinder in the laboratory")
    return found


def cost(config, trials, cores=2):
    """'63 heaps, 9 minutes': from the pilot's speed and the study's grains and steps; None where
    none ran."""
    ran = [t for t in trials if t.seconds > 0]
    if not ran:
        return None
    full, small = config.run["particles"], coarse(config.run)["particles"]
    finer = small["diameter_mm"] / full["diameter_mm"] if "diameter_mm" in small else 1.0
    seconds = np.mean([t.seconds for t in ran]) * full["count"] / small["count"] * finer
    heaps = expected_runs(config)
    minutes = heaps * seconds / cores / 60
    return f"{heaps} heaps, about {minutes:.0f} minutes on {cores} cores" if minutes >= 1 else (
        f"{heaps} heaps, about {60 * minutes:.0f} seconds on {cores} cores"
    )  # fmt: skip
