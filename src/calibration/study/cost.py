"""What a run costs, estimated from its spec before it is made: time of one core, and memory."""

import math
import os
from collections.abc import Callable, Mapping
from typing import Any

from dem.constants import GRAVITY
from dem.flow import C_BEVERLOO, beverloo
from dem.grains.sizes import grain_volume, spheres_in
from dem.spec import RunSpec, parse_spec

BASE_MB, MB_PER_GRAIN = 250.0, 0.003
"""Memory of a run. Python with the compiled engine takes the first (a heap of 1,250 spheres took
206 MB), each grain the second: twice 160 bytes of state, about twelve neighbours of 45 bytes in two
lists, 1.4 kB together, and as much again for copies."""

GRAIN_STEPS_PER_S = 1.0e7
"""Of one core; a third of what a settled bed takes on the machine of the README."""

RUN_S, STEP_S = 0.3, 4.0e-6
"""What a run takes for its files, and for each step beside its grains; measured with one to five
grains: 26,000 steps 0.3 s, 1.4 million 4.8 s."""

START_S = 4.0
"""What a job of the workflow takes of one core before its first run [s]; measured."""

LEAST_JOBS = 8
"""Jobs that a plan is parted into at least, and a divisor of their number, so that 2, 4 or 8 cores
end together. A plan whose runs take less than the starts of so many has 4, 2 or 1."""

BONDED = 4
"""Grains of a tilt test, which slide as one body."""

REST_S, TAP_S = 0.7, 0.25
"""Simulated time in which grains come to rest, and that of a tap."""

LIFTED = 1.2  # of its own depth of grains, by which a cylinder is lifted
PACKING = 0.6  # solid fraction of a bed


def run_seconds(run: Mapping[str, Any]) -> float | None:
    """Time of one run [s] of one core, estimated from its spec (a mapping); None for an experiment
    whose duration nothing tells, and for another engine."""
    spec = parse_spec(run)
    asked = set(type(spec.geometry).model_fields)
    own = [of_run for fields, of_run in LASTS.items() if asked.issuperset(fields)]
    if not own or spec.engine is not None:
        return None
    lasts, moved = (of_run(spec) for of_run in own[0])
    if lasts is None:
        return None
    from dem.experiments.setup import time_step_of  # loads the engine

    return RUN_S + lasts / time_step_of(spec) * (STEP_S + moved / GRAIN_STEPS_PER_S)


def _spheres(spec):
    """Spheres of all grains."""
    clump = spec.particles.clump
    parts = len(spheres_in(clump)) if clump else 2 if spec.particles.elongation > 1.0 else 1
    return parts * spec.particles.count


def _of_heap(spec):
    rate = spec.geometry.generation_rate_per_s
    # half of the grains on average while they are poured, all of them while they come to rest
    return None if rate is None else 0.5 * spec.particles.count / rate + REST_S


def _of_lifted_cylinder(spec):
    g = spec.geometry
    depth = _depth_mm(spec, g.cylinder_diameter_mm)
    return _fall(depth) + REST_S + LIFTED * depth / g.lift_speed_mm_s + REST_S


def _of_bulk_density(spec):
    g = spec.geometry
    wide = g.simulated_diameter_mm or g.vessel_diameter_mm
    return _fall(_depth_mm(spec, wide)) + REST_S + TAP_S * g.taps


def _of_tilt(spec):
    friction = spec.contacts.particle_wall.static_friction
    return spec.geometry.trials * math.degrees(math.atan(friction)) / spec.geometry.tilt_rate_deg_s


def _of_shear(spec):
    g = spec.geometry
    path = g.preshear_displacement_mm + g.shear_displacement_mm
    return REST_S + path / g.shear_speed_mm_s


def _of_discharge(spec):
    g = spec.geometry
    diameter = (6.0 * grain_volume(spec) / math.pi) ** (1 / 3)
    # of solid volume in a second
    flow = C_BEVERLOO * beverloo(PACKING, 1e-3 * g.orifice_diameter_mm, diameter)
    if not flow:
        return None
    depth = _depth_mm(spec, g.silo_diameter_mm)
    # half of the grains on average while they run out
    return _fall(depth) + REST_S + 0.5 * spec.particles.count * grain_volume(spec) / flow


def _depth_mm(spec, across):
    """Depth of a bed of all grains in a cylinder [mm]."""
    bulk = 1e9 * spec.particles.count * grain_volume(spec) / PACKING
    return bulk / (0.25 * math.pi * across**2)


def _fall(height_mm):
    return math.sqrt(2e-3 * height_mm / GRAVITY)


OfRun = Callable[[RunSpec], Any]
LASTS: dict[tuple[str, ...], tuple[OfRun, OfRun]] = {
    ("generation_rate_per_s",): (_of_heap, _spheres),
    ("drop_height_mm", "drops"): (
        # the rebound takes no longer than the fall
        lambda spec: 2.0 * _fall(spec.geometry.drop_height_mm), lambda spec: spec.geometry.drops,
    ),
    ("cylinder_diameter_mm", "lift_speed_mm_s"): (_of_lifted_cylinder, _spheres),
    ("vessel_diameter_mm", "taps"): (_of_bulk_density, _spheres),
    ("orifice_diameter_mm", "silo_diameter_mm"): (_of_discharge, _spheres),
    ("tilt_rate_deg_s", "trials"): (_of_tilt, lambda spec: BONDED),
    ("preshear_displacement_mm", "shear_displacement_mm", "shear_speed_mm_s"): (
        _of_shear, _spheres,
    ),
    ("slide_mm", "slide_speed_mm_s"): (
        lambda spec: REST_S + spec.geometry.slide_mm / spec.geometry.slide_speed_mm_s, _spheres,
    ),
}  # fmt: skip
"""{what a geometry asks for: (simulated time [s] of a run in which all of its grains move, or None;
spheres that move)}. So an experiment of one's own that asks for the same has an estimate too."""


def memory_mb(count: float) -> float:
    """Memory [MB] of a run of `count` grains, estimated."""
    return BASE_MB + MB_PER_GRAIN * count


def machine_memory_mb() -> float:
    """Physical memory of this machine [MB]."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e6


def duration(seconds: float) -> str:
    """'40 s', '12 min', '3 h 20 min'."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
