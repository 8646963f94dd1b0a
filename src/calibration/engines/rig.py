"""What the decks of other engines share: the spec in their terms, and metrics from the state that
they leave."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from calibration.engines import EngineError
from calibration.engines.conversion import Conversion, Granulate, left_out
from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS
from dem.experiments.heap import Rig
from dem.experiments.setup import time_step_of
from dem.grains.sizes import mean_radius, number_fractions
from dem.materials import material_of
from dem.measure.heap import measure_heap
from dem.spec import RunSpec, Sizes
from dem.timescales import hertz_contact_time

COLLAR = 0.75
"""Height of the wall above the funnel's rim, within which grains are made, in radii of its
mouth."""
EXTRA = 0.3
"""Time after the last grain is made before a deck first looks whether the heap is at rest [s]."""
LOOK = 0.05
"""Time between these looks [s]."""
SLICES = 5
"""Single sizes that stand for a class of a sieve curve."""


def refuse(spec: RunSpec, name: str, code: str) -> None:
    """Raise EngineError for what a code cannot represent of a `RunSpec`: laws by name, meshes.
    name: for the sentence; code: as the laws' exports have it."""
    laws = LAWS["rolling"].values()
    known = [law for law in laws if not law.kernels or code in law.exports]
    names = [law.name for law in sorted(known, key=lambda law: bool(law.kernels))]
    if spec.laws.rolling not in names:  # type: ignore[attr-defined]  # a field for each law
        raise EngineError(
            f"{name} has no rolling friction {spec.laws.rolling}; a study in {name} takes "  # type: ignore[attr-defined]  # a field for each law
            f"run.laws.rolling: {' or '.join(names)}"
        )
    refuse_lost(spec, name, code)


def refuse_lost(spec: RunSpec, name: str, code: str) -> None:
    """As `refuse`, without the check of the rolling law: a deck takes its number from a search."""
    told = left_out(spec, code)
    lost = [s.removeprefix("NOT CONVERTED: ") for s in told if "NOT CONVERTED" in s]
    if lost:
        raise EngineError(f"{name} cannot represent: {' '.join(lost)}")
    if getattr(spec.geometry, "feed", "rain") != "rain":
        raise EngineError(f"{name}: geometry.feed: opened is not carried over; feed: rain is")
    if getattr(spec.geometry, "plate_rim_height_mm", 0.0):
        raise EngineError(f"{name}: geometry.plate_rim_height_mm is not carried over")
    meshes = [k for k in ("funnel_stl", "plate_stl") if getattr(spec.geometry, k, None)]
    if meshes:
        raise EngineError(
            f"{name}: geometry.{meshes[0]} is not carried over; the rig's own walls are"
        )


def block_of(block: Callable[..., str], spec: RunSpec) -> str:
    """Text of a code's material block for a `RunSpec`; block: the function of its module."""
    return block(Granulate(spec), Conversion(spec), ["A run of a study, in SI units."])


def sliced(sizes: Sizes) -> Sizes:
    """Single sizes in place of a sieve curve's classes, which these codes pour no grains between:
    each class in SLICES of equal share, each of its grain of mean volume. Mass and number of all
    grains are as before."""
    if sizes.upper_diameters_mm is None:
        return sizes
    found, shares = [], []  # type: ignore[var-annotated]
    for a, b, share in zip(
        sizes.diameters_mm, sizes.upper_diameters_mm, sizes.fractions, strict=True
    ):
        if a == b:
            found, shares = [*found, a], [*shares, share]
            continue
        edges = np.linspace(a, b, SLICES + 1)
        # the share is even over the diameter: by mass the number goes with its power of -3
        for low, high in pairwise(edges):
            cube = (
                2.0 * (low * high) ** 2 / (low + high)
                if sizes.by == "mass"
                else (low + high) * (low**2 + high**2) / 4.0
            )
            found.append(float(np.cbrt(cube)))
            shares.append(share / SLICES)
    single = {"diameters_mm": found, "upper_diameters_mm": None, "fractions": shares}
    return sizes.model_copy(update=single)


class Pour:
    """A funnel heap in SI units, as a deck needs it."""

    def __init__(self, spec: RunSpec) -> None:
        p, g = spec.particles, spec.geometry
        self.rig, self.count = Rig(g), p.count
        self.rate, self.speed = g.generation_rate_per_s, g.injection_speed_m_s
        sizes = sliced(p.sizes) if p.sizes else None
        scale = 0.5e-3 * p.scale_factor
        # radius [m] and share by number of each size
        self.radii = tuple(scale * d for d in (sizes.diameters_mm if sizes else (p.diameter_mm,)))
        self.shares = tuple(number_fractions(sizes)) if sizes else (1.0,)
        self.density = spec.materials.particle.density_kg_m3
        self.dt, self.max_time = time_step_of(spec), spec.numerics.max_time_s
        lift = sum(s * 4 / 3 * math.pi * r**4 for r, s in zip(self.radii, self.shares, strict=True))
        ratio = spec.numerics.rest_energy_ratio
        # kinetic energy of translation below which the heap is at rest [J]. A grain that spins
        # about the normal of its contacts has no resistance in these codes, and does not move it
        self.rest_energy = ratio * p.count * self.density * GRAVITY * lift

    @property
    def largest(self) -> float:
        """Radius of the largest grain [m]."""
        return max(self.radii)

    @property
    def bottom(self) -> float:
        """Height below which grains are lost [m]."""
        return self.rig.lost_height

    @property
    def top(self) -> float:
        """Upper end of the wall above the funnel [m]."""
        return self.rig.rim_height + COLLAR * self.rig.mouth_radius

    @property
    def looks(self) -> tuple[int, int, int]:
        """(steps before the first look at the kinetic energy, steps between looks, greatest
        number of looks)."""
        first = min(self.count / self.rate + EXTRA, self.max_time)
        more = max(math.ceil((self.max_time - first) / LOOK), 1)
        return round(first / self.dt), round(LOOK / self.dt), more

    @property
    def end(self) -> str:
        """Commands that run until the heap is at rest, and dump it."""
        (first, between, looks), common = self.looks, words("family")
        rest = common.until("rest", between, looks, self.rest_energy, 0)
        return common.heap_end(first) + rest + common.dump("end")


def heap_metrics(state: Mapping[str, np.ndarray], pour: Pour, made: int) -> dict[str, Any]:
    """Metrics of a heap from the last state that another engine left; made: grains that it made.
    Raises EngineError where fewer grains were made than asked. state: arrays as `program.state_of`
    gives them."""
    if made < pour.count:
        raise EngineError(
            f"made {made} of {pour.count} grains: the funnel does not take them; widen the "
            "orifice, or make fewer a second"
        )
    x, r, v = state["position"], state["radius"], state["velocity"]
    metrics = measure_heap(x, r, v, pour.rig.plate_radius)
    inside = int((x[:, 2] > pour.rig.left_height).sum())
    return metrics | {"spilled": pour.count - len(r), "in_funnel": inside}


def box_around(position: np.ndarray, radius: float) -> str:
    """Bounds of a box with room around grains at `position` (n, 3) [m], as a deck writes them."""
    room = 20.0 * radius
    low, high = position.min(axis=0) - room, position.max(axis=0) + room
    low[2] = -radius  # nothing falls below the floor
    return " ".join(f"{a:.6g} {b:.6g}" for a, b in zip(low, high, strict=True))


class Drop:
    """A drop test in SI units."""

    def __init__(self, spec: RunSpec) -> None:
        """Raises EngineError for an output interval, which other engines do not have."""
        if spec.geometry.output_interval_s:
            raise EngineError("geometry.output_interval_s is not carried over to other engines")
        m = spec.materials
        self.radius, self.height = mean_radius(spec), 1e-3 * spec.geometry.drop_height_mm
        self.drops, self.density = spec.geometry.drops, m.particle.density_kg_m3
        self.dt, self.impact = time_step_of(spec), math.sqrt(2.0 * GRAVITY * self.height)
        bodies = material_of(m.particle), material_of(m.wall)
        self.contact_time = hertz_contact_time(self.radius, self.impact, *bodies)

    def starts(self, seed: int) -> np.ndarray:
        """Positions (drops, 3) [m] of the grains: far apart, at different phases of the
        time step."""
        rng = np.random.default_rng(seed)
        phase = (np.arange(self.drops) + rng.random()) / self.drops
        z = self.radius + self.height + phase * self.impact * self.dt
        x = 20.0 * self.radius * np.arange(self.drops)
        return np.column_stack([x, np.zeros(self.drops), z])

    @property
    def looks(self) -> tuple[int, int, int]:
        """(steps until all grains have met the plate, steps between looks, number of looks)."""
        fall = math.sqrt(2.0 * self.height / GRAVITY)
        every = max(round(0.01 * fall / self.dt), 1)
        return round((fall + 2.0 * self.contact_time) / self.dt), every, 20

    def metrics(self, z: np.ndarray, v: np.ndarray, start: np.ndarray) -> dict[str, float]:
        """Metrics from heights z and speeds v (looks, drops) of the centres after the impact, and
        `start` (drops,). Lengths in m, speeds in m/s. Raises EngineError where a grain did not
        rebound."""
        rising = v > 0.0
        if not rising.any(axis=0).all():
            raise EngineError("a grain did not rebound within a fifth of its fall")
        # while it rises freely the height that it will reach follows from its energy
        reach = np.where(rising & (z > self.radius), z - self.radius + v**2 / (2.0 * GRAVITY), 0.0)
        apex = reach.max(axis=0)
        restitution = np.sqrt(apex / (start - self.radius))
        spread = {"ddof": 1} if self.drops > 1 else {}
        return {
            "rebound_height_mm": 1e3 * float(apex.mean()),
            "rebound_height_sd_mm": 1e3 * float(apex.std(**spread)),
            "true_rebound_height_mm": 1e3 * float(apex.mean()),
            "effective_restitution": float(restitution.mean()),
            "effective_restitution_sd": float(restitution.std(**spread)),
            "impact_speed_m_s": self.impact,
            "contact_time_s": self.contact_time,
            "steps_per_contact": self.contact_time / self.dt,
        }
