"""What would bring the pilot's heaps up to a measured angle that is steeper than all of them: the
heap at the ends of the ranges that steepen it, then that heap with one thing changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.study.config import overlay
from calibration.study.new.heap import roomy_height
from calibration.study.new.pilot import levels_at, one_heap
from calibration.study.new.ranges import UNPUBLISHED, most_published

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.factors import Factor
    from calibration.study.new.pilot import Trial


LONGER = 1.3  # length over width of a longer grain
LOWER = 0.9  # of the orifice's height, above which a lower one is not tried
FRICTION = ("static_friction", "rolling_friction")


@dataclass(frozen=True)
class Change:
    """One change of the pilot's steepest heap: in words, of the run spec, of the levels {key:
    value}."""

    words: str
    run: dict = field(default_factory=dict)
    levels: dict = field(default_factory=dict)


def reach(
    config: Config,
    factors: Sequence[Factor],
    trials: Sequence[Trial],
    measured: float,
    show: Callable[[str], object] = lambda text: None,
) -> list[str]:
    """Sentences on how a measured angle [deg] can be reached that is steeper than all heaps of a
    pilot; none where a heap is as steep or none stands."""
    standing = [t for t in trials if not t.fault]
    if not standing or any(_as_steep(t, measured) for t in standing):
        return []
    point = steepest_corner(trials)
    levels = levels_at(factors, point)
    corner = one_heap(config, config.run, levels, point)
    show(f"heap at the ends that steepen it: {corner.found} ({corner.seconds:.0f} s)")
    if _as_steep(corner, measured):
        return ["the ranges reach yours, at the ends that steepen the heap"]
    reaching = []
    for change in changes(config, factors, measured):
        trial = one_heap(config, overlay(config.run, change.run), levels | change.levels, point)
        show(f"the same, {change.words}: {trial.found} ({trial.seconds:.0f} s)")
        if _as_steep(trial, measured):
            reaching.append(change.words)
    if reaching:
        return [f"within the ranges no heap reaches yours; one does {', or '.join(reaching)}"]
    return ["no heap reaches yours; was it measured in this rig, on grains of this shape?"]


def _as_steep(trial, measured):
    """Whether a heap reaches the angle [deg]; one that has grown into the orifice does as well."""
    return trial.angle_deg is not None and trial.angle_deg >= measured


def steepest_corner(trials: Sequence[Trial]) -> tuple[float, ...]:
    """The point of the unit cube at the end of each range that steepens the heap: that of the
    larger mean angle. Grains that roll off are flat."""
    points = np.array([t.point for t in trials])
    angles = np.array([0.0 if t.angle_deg is None else t.angle_deg for t in trials])
    return tuple(float(angles[at == 1.0].mean() >= angles[at == 0.0].mean()) for at in points.T)


def changes(config: Config, factors: Sequence[Factor], measured: float) -> list[Change]:
    """[Change] that may steepen a heap up to `measured` [deg] and are not made yet: of the rig, of
    the grain, and of ranges that no publication gives."""
    return [*_of_the_rig(config.run, measured), *_of_the_grain(config.run), *_of_ranges(factors)]


def _of_the_rig(run, measured):
    geometry = run["geometry"]
    rim, height = geometry.get("plate_rim_height_mm", 0.0), geometry["discharge_height_mm"]
    rate, time = geometry["generation_rate_per_s"], run["numerics"]["max_time_s"]
    plate = geometry["plate_diameter_mm"]
    above = roomy_height(plate, rim, measured)
    if above < LOWER * height:
        yield Change(
            f"poured from {above} mm, a little above the heap (--height)",
            {"geometry": {"discharge_height_mm": above}},
        )
    yield Change(
        "poured at a quarter of the rate (--rate)",
        {"geometry": {"generation_rate_per_s": 0.25 * rate}, "numerics": {"max_time_s": 4 * time}},
    )
    if not rim and not geometry.get("plate_stl"):
        grain = _largest(run["particles"])
        high = max(height, roomy_height(plate, grain, measured))
        yield Change(
            f"on a plate with a rim of one grain, {grain:.3g} mm (--rim)",
            {"geometry": {"plate_rim_height_mm": grain, "discharge_height_mm": high}},
        )


def _largest(particles):
    sizes = particles.get("sizes")
    return max(sizes["diameters_mm"]) if sizes else particles["diameter_mm"]


def are_spheres(particles: Mapping[str, Any]) -> bool:
    """Whether a run spec's grains are spheres, which longer ones stand steeper than."""
    return particles.keys().isdisjoint({"elongation", "clump"})


def _of_the_grain(run):
    if are_spheres(run["particles"]):
        words = f"of grains {LONGER:g} times as long as wide (particles.elongation)"
        yield Change(words, {"particles": {"elongation": LONGER}})


def _of_ranges(factors):
    for f in factors:
        most = most_published(f.key) if f.key.endswith(FRICTION) else None
        if most and UNPUBLISHED in f.description and most[0] > f.high:
            value, material = most
            words = f"with {f.name} {value:g}, the most that is published here (of {material})"
            yield Change(words, levels={f.key: value})
