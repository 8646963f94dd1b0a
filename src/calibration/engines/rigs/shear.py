"""The ring shear cell in other codes: the lid is a wall that a servo presses on the grains.

Ours is a lid of the grains' mass with a drag. A servo has neither: its speed is
v = b (f - F) + (1/m) integral of (f - F), where f presses up and F is wanted down. The second term
is the same mass. The first one, b, damps the lid on its grains as the drag does ours.
"""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from calibration.engines import EngineError, bed
from calibration.engines.conversion import Granulate
from calibration.engines.family import Code
from calibration.engines.program import read_dump, state_of
from calibration.engines.rigs import Lid
from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.experiments import phases
from dem.experiments import shear_ring as own
from dem.experiments.setup import time_step_of
from dem.grains.sizes import draw_radii, fall_time, largest_reach, mean_radius
from dem.spec import RunSpec

AT_REST = 1e-4
"""Energy at which the grains rest, of what lifts each by its radius [-]; as `own.Ring.rest`."""
PARTS = 20
"""Steps of a change of load."""


class Cell(own.Ring):
    """Our cell without its simulation: sizes, walls, grains at the start, loads."""

    def __init__(self, spec: RunSpec) -> None:
        g, rng = spec.geometry, np.random.default_rng(spec.seed)
        self.spec = spec
        self.inner, self.outer = 0.5e-3 * g.inner_diameter_mm, 0.5e-3 * g.outer_diameter_mm
        self.area = math.pi * (self.outer**2 - self.inner**2)
        self.moment = 2.0 / 3.0 * math.pi * (self.outer**3 - self.inner**3)
        self.rate = 1e-3 * g.shear_speed_mm_s / (0.5 * (self.inner + self.outer))
        self.fall_time = fall_time(spec)
        self.lid, self.floor = own.meshes(spec)
        self.sim = bed.Grains(spec.materials.particle.density_kg_m3)
        reach = largest_reach(spec)
        self.top = self.fill(spec, draw_radii(spec, spec.particles.count, rng), reach, rng)
        self.high, self.walls = self.height(spec, reach), self.build_walls(spec, reach)
        next(b for b in self.walls.bodies if b["name"] == "lid")["origin"] = (0.0, 0.0, self.top)
        self.mass = float(self.sim.mass.sum())
        self.weight = self.mass * GRAVITY

    @property
    def mobility(self) -> float:
        """b [m/s/N]: a lid of stiffness k swings as exp(-b k t/2), ours as
        exp(-t / (2 fall_time))."""
        grains, radius = Granulate(self.spec), mean_radius(self.spec)
        count = self.area / (4.0 * radius**2)
        layers = max(self.spec.particles.count / count, 1.0)
        load = 1e3 * self.spec.geometry.normal_stress_kPa * self.area / count
        pair = grains.grain_grain
        contact = (0.75 * load * pair.radius / pair.young) ** (1.0 / 3.0)
        return layers / (self.fall_time * count * 2.0 * pair.young * contact)

    def force(self, stress_kPa: float) -> float:
        """Return what the lid presses with under a normal stress [N]."""
        return 1e3 * stress_kPa * self.area

    def stretch(self, path_mm: float) -> int:
        """Time steps of one of own.STRETCHES of a shear path."""
        speed = self.rate * 0.5 * (self.inner + self.outer)
        return max(round(1e-3 * path_mm / speed / time_step_of(self.spec) / own.STRETCHES), 1)


def deck(spec: RunSpec, code: Code, folder: Path) -> str:
    """Text of the deck of a `RunSpec`; its grains and walls are written into `folder`."""
    cell, g = Cell(spec), spec.geometry
    before = cell.force(g.preshear_normal_stress_kPa or g.normal_stress_kPa)
    test = cell.force(g.normal_stress_kPa)
    side, high = cell.outer + bed.ROOM, cell.high + bed.ROOM
    lid = Lid("lid", cell.top, cell.weight, cell.mass, cell.mobility, GRAVITY * cell.fall_time)
    return "".join(
        [
            bed.start(spec, cell.sim, code, folder, (-side, -side, -bed.ROOM), (side, side, high)),
            code.walls(cell.walls, folder, lid=lid),
            words("family").energy(),
            _rest(cell, "filled", own.FILLED),
            _load(cell, code, lid, "pressed", cell.weight, before),
            _rest(cell, "compact", own.PRESSED),
            _shear(cell, code, "preshear", g.preshear_displacement_mm),
            _load(cell, code, lid, "relieved", before, test),
            _rest(cell, "ready", own.RELIEVED),
            words("family").height(code.words.height(lid)),  # type: ignore[misc]
            _shear(cell, code, "shear", g.shear_displacement_mm),
            words("family").dump("end"),
        ]
    )


def _rest(cell, label, limit):
    looks, step = round(limit / phases.LOOK), bed.steps(cell.spec, phases.LOOK * cell.fall_time)
    calm = AT_REST * cell.sim.lift_energy
    return words("family").until(label, step, looks, calm, round(phases.SOONEST / phases.LOOK))


def _load(cell, code, lid, label, now, wanted):
    steps = bed.steps(cell.spec, own.RAMP / PARTS * cell.fall_time)
    return words("family").load(label, PARTS, now, wanted - now, code.words.load(lid), steps)


def _shear(cell, code, label, path_mm):
    steps, turn = cell.stretch(path_mm), code.words.turn("trough", cell.rate)
    watch, stop = code.words.watch(label, "lid", steps), code.words.stop("trough")
    return words("family").shear(label, steps, steps * own.STRETCHES, turn, watch, stop)


def read(spec: RunSpec, folder: Path, output: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Metrics and last state of a run in `folder`. Raises EngineError. The state is as
    `program.state_of` gives it."""
    cell, state = Cell(spec), state_of(read_dump(folder / "end.dump"))
    lost = spec.particles.count - len(state["radius"])
    if lost:
        raise EngineError(f"{lost} grains left the shear cell")
    _, preshear = _stresses(cell, folder / "preshear.txt")
    normal, curve = _stresses(cell, folder / "shear.txt")
    late, depth = curve[own.STRETCHES // 2 :], float(re.search(r"^lid (\S+)", output, re.M)[1])  # type: ignore[index]
    smooth = sliding_window_view(curve, own.STRETCHES // 10).mean(axis=1)
    return {
        "shear_stress_kPa": float(smooth.max()),
        "steady_shear_stress_kPa": float(late.mean()),
        "steady_shear_stress_sd_kPa": float(late.std(ddof=1)),
        "preshear_stress_kPa": float(preshear[own.STRETCHES // 2 :].mean()),
        "normal_stress_kPa": float(normal.mean()),
        "bulk_density_kg_m3": cell.mass / (depth * cell.area),
    }, state


def _stresses(cell, path):
    """Normal and shear stress (own.STRETCHES,) [kPa] on the lid. Raises EngineError."""
    try:
        rows = [row.split() for row in path.read_text().splitlines() if row[:1] != "#"]
        _, force, torque = np.array(rows, float).T
    except (OSError, ValueError) as error:
        raise EngineError(f"{path.name} cannot be read: {error}") from None
    if len(force) != own.STRETCHES:
        raise EngineError(f"{path.name} holds {len(force)} of {own.STRETCHES} stretches")
    return 1e-3 * force / cell.area, 1e-3 * torque / cell.moment
