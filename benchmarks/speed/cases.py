"""The benchmark cases: settled beds in a box, and the funnel heap at full scale."""

import resource
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import yaml

from dem.contact.registry import ContactParameters, Laws, Material
from dem.experiments import heap
from dem.simulation import Simulation
from dem.spec import parse_spec
from dem.walls.builder import WallSet

SALT = Material(1210.0, 1.0e7, 0.25)
CONTACT = ContactParameters(0.544, 0.5, 0.23)
TIME_STEP = 7.5e-6
RADIUS = 1e-3
PITCH = 2.1 * RADIUS
STIR = 0.5  # m/s
SETTLE_STEPS, BLOCK, BLOCKS = 24000, 5000, 3


def _across(n):
    """Grains across the box of a bed of n: all beds have the shape of that of 10,000."""
    return round(19 * (n / 10000) ** (1 / 3))


def box_width(n: int) -> float:
    """Width [m] of the box of a bed of n."""
    return _across(n) * PITCH + 0.06 * PITCH


def lattice(n: int, seed: int = 1) -> np.ndarray:
    """Jittered start (n, 3) [m] on a square lattice."""
    across = _across(n)
    k = np.arange(n)
    layer, rest = np.divmod(k, across * across)
    site = np.column_stack([rest % across, rest // across, layer]) * PITCH + 0.53 * PITCH
    shift = np.random.default_rng(seed).uniform(-0.049, 0.049, (n, 3)) * RADIUS
    return site + shift


def tiled(sim: Simulation, across: int) -> tuple[np.ndarray, float]:
    """(positions (n, 3) [m], width [m]) of a bed of equal grains, settled, repeated `across` times
    both ways."""
    sim.advance(SETTLE_STEPS)
    width = box_width(sim.n)
    k = np.repeat(np.arange(across), across), np.tile(np.arange(across), across)
    shift = width * np.column_stack([*k, np.zeros(across * across)])
    return (sim.position[None] + shift[:, None]).reshape(-1, 3), across * width


def bed(
    n: int = 10000,
    rolling: str = "constant_torque",
    start: tuple[np.ndarray, float] | None = None,
    stir: float = STIR,
    threads: int | None = None,
) -> Simulation:
    """A box of n equal grains that have yet to settle.

    start: (positions (n, 3) [m], width [m]) in place of the lattice; stir: largest speed along an
    axis [m/s].
    """
    rng = np.random.default_rng(2)
    radius = np.full(n, RADIUS)
    position, width = start or (lattice(n), box_width(n))
    walls = WallSet().body("box", material="salt")
    for point, normal in (
        ((0, 0, 0), (1, 0, 0)),
        ((width, 0, 0), (-1, 0, 0)),
        ((0, 0, 0), (0, 1, 0)),
        ((0, width, 0), (0, -1, 0)),
        ((0, 0, 0), (0, 0, 1)),
    ):
        walls.plane(point, normal)
    sim = Simulation(
        {"salt": SALT},
        {("salt", "salt"): CONTACT},
        laws=Laws(rolling=rolling),
        time_step=TIME_STEP,
        walls=walls,
        threads=threads,
    )
    # the lattice alone settles into standing columns with half the contacts of a bed
    sim.add_particles(position, radius, velocity=rng.uniform(-stir, stir, (n, 3)))
    return sim


def timed_bed() -> list[dict[str, Any]]:
    """Settle a bed, then time BLOCKS stretches of BLOCK steps by the processor's clock; returns the
    figures of the fastest."""
    sim = bed()
    sim.advance(SETTLE_STEPS)
    best = block_rates(sim, BLOCKS).max()
    return [figures_of("settled bed", sim) | {"particle_steps_per_s": best}]


def block_rates(sim: Simulation, blocks: int) -> np.ndarray:
    """Particle-steps per second of processor (blocks,) of the next blocks of BLOCK steps."""
    times = [time.process_time()]
    for _ in range(blocks):
        sim.advance(BLOCK)
        times.append(time.process_time())
    return sim.n * BLOCK / np.diff(times)


def timed_heap() -> list[dict[str, Any]]:
    """The funnel heap of calibrated salt, from start to rest, without measuring the angle."""
    spec = parse_spec(yaml.safe_load(Path(__file__).with_name("heap.yaml").read_text()))
    looks: Any = [(0, 0)]
    nothing: Any = lambda *_: None  # noqa: E731
    work: Any = SimpleNamespace(
        progress=nothing, resume=nothing, checkpoint=nothing,
        frame=lambda sim: looks.append((sim.steps, sim.n)),
    )  # fmt: skip
    begin, spent = time.perf_counter(), time.process_time()
    sim = heap.pour(spec, work)[0]
    steps, grains = np.transpose(looks)
    wall, spent = time.perf_counter() - begin, time.process_time() - spent
    rate = (np.diff(steps) * grains[1:]).sum() / spent
    return [figures_of("funnel heap", sim) | {"wall_time_s": wall, "particle_steps_per_s": rate}]


def figures_of(case: str, sim: Simulation) -> dict[str, Any]:
    """Return what is told of each case: with the largest resident memory of this process so far."""
    return {
        "case": case,
        "rebuild_share": sim.rebuild_seconds / max(sim.advance_seconds, 1e-12),
        "peak_memory_MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
