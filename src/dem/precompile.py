"""Compile the engine's kernels into numba's disk cache."""

from dem.contact.registry import ContactParameters, Material
from dem.simulation import Simulation
from dem.walls.builder import WallSet


def compile_engine(precision: str = "mixed") -> None:
    """Run a few steps of two grains on a plate, which compiles everything that a run needs."""
    material = Material(1200.0, 1e7, 0.25)
    contact = ContactParameters(0.5, 0.5, 0.1)
    walls = WallSet().body("plate", material="wall").plane((0, 0, 0), (0, 0, 1))
    sim = Simulation(
        {"particle": material, "wall": material},
        {("particle", "particle"): contact, ("particle", "wall"): contact},
        time_step=1e-5,
        precision=precision,
        walls=walls,
    )
    sim.add_particles([[0.0, 0.0, 1e-3], [1.99e-3, 0.0, 1e-3]], 1e-3)
    sim.advance(2)
    sim.remove(sim.tag[:1])
    sim.advance(2)
