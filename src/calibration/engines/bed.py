"""The start of a bed in another code: the very grains, places and speeds that ours starts from, and
commands that run until they rest."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from calibration.engines.family import Code
from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.experiments import bed, phases
from dem.experiments.setup import time_step_of
from dem.grains.sizes import draw_radii, largest_reach, smallest_radius
from dem.spec import RunSpec

SETTLED = 1e-4
"""Energy of motion at which `dem.experiments.phases.rest` takes the grains to rest."""
ROOM = 0.01
"""Free height of the box above the highest wall or grain [m]."""


class Grains:
    """Spheres as arrays, where this engine's functions take a `Simulation`: to be filled by
    `bed.fill`, or as another code left them."""

    def __init__(self, density: float, state: Mapping[str, np.ndarray] | None = None) -> None:
        """density [kg/m3]; state: arrays as `program.state_of` gives them, none at first."""
        state = state or {k: np.empty((0, 3)) for k in ("position", "velocity")}
        self.density = density
        self.position, self.velocity = state["position"], state["velocity"]
        self.radius = state.get("radius", np.empty(0))

    def add_particles(self, position: np.ndarray, radius: np.ndarray, velocity: np.ndarray) -> None:
        """Add spheres: position, velocity (n, 3) [m], [m/s], radius (n,) [m]."""
        self.position = np.concatenate([self.position, position])
        self.velocity = np.concatenate([self.velocity, velocity])
        self.radius = np.concatenate([self.radius, radius])

    @property
    def n(self) -> int:
        """Number of spheres."""
        return len(self.radius)

    @property
    def cubed_radius(self) -> np.ndarray:
        """(n,) [m3]"""
        return self.radius**3

    @property
    def mass(self) -> np.ndarray:
        """(n,) [kg]"""
        return 4.0 / 3.0 * np.pi * self.density * self.cubed_radius

    @property
    def lift_energy(self) -> float:
        """Energy that lifts every grain by its radius [J]."""
        return GRAVITY * float((self.mass * self.radius).sum())

    def data(self, low: Sequence[float], high: Sequence[float]) -> str:
        """Text of a data file of LIGGGHTS or LAMMPS: these grains in the box low..high (3,) [m]."""
        text: str = words("family").data(self, list(zip(low, high, "xyz", strict=True)))
        return text


def filled(spec: RunSpec, radius: float, bottom: float) -> tuple[Grains, float]:
    """`Grains` that ours makes in a cylinder of `radius` above `bottom` [m] with the spec's seed,
    and the height that none of them reaches [m]."""
    rng, reach = np.random.default_rng(spec.seed), largest_reach(spec)
    radii = draw_radii(spec, spec.particles.count, rng)
    sites = bed.sites_in_circle(radius, reach, rng)
    grains = Grains(spec.materials.particle.density_kg_m3)
    bed.fill(grains, spec, radii, sites, bottom, reach, rng)  # type: ignore[arg-type]  # arrays stand in for it
    return grains, bed.highest_site(len(radii), sites, bottom, reach)


def start(
    spec: RunSpec,
    grains: Grains,
    code: Code,
    folder: Path,
    low: Sequence[float],
    high: Sequence[float],
) -> str:
    """Head of a deck whose grains stand in a data file, written into `folder`."""
    (folder / "grains.data").write_text(grains.data(low, high))
    return code.head(spec, "read_data grains.data", smallest_radius(spec))


def settle(spec: RunSpec, grains: Grains) -> str:
    """Commands that run until the grains rest, as `phases.rest` does, and dump them."""
    step = steps(spec, phases.look(spec))
    looks = max(round(spec.numerics.max_time_s / phases.look(spec)), 1)
    common, calm = words("family"), SETTLED * grains.lift_energy
    until = common.until("settled", step, looks, calm, 5)
    return common.energy() + until + common.dump("settled")


def steps(spec: RunSpec, duration: float) -> int:
    """Time steps in `duration` [s], one at least."""
    return max(round(duration / time_step_of(spec)), 1)
