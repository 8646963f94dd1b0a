"""The discharge of a silo in other codes. What has left lies below the box and is taken out there.
The mass that is left is printed at each look, and read as ours is watched."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import NO_GRAINS, bed
from calibration.engines.family import Code
from calibration.engines.program import read_dump, state_of
from calibration.engines.templates import words
from dem.experiments import discharge as own
from dem.experiments import outflow
from dem.experiments.phases import look as pause_of
from dem.experiments.setup import time_step_of
from dem.flow import beverloo
from dem.grains.sizes import mean_radius
from dem.spec import RunSpec


def deck(spec: RunSpec, code: Code, folder: Path) -> str:
    """Text of the deck of a `RunSpec`; its grains and walls are written into `folder`."""
    silo = own.Silo(spec.geometry)
    grains, top = bed.filled(spec, silo.radius, silo.shoulder)
    walls, side = silo.walls(top), silo.radius + bed.ROOM
    low = -own.OUT * 2.0 * mean_radius(spec)
    text = bed.start(spec, grains, code, folder, (-side, -side, low), (side, side, top))
    text += code.walls(walls, folder) + bed.settle(spec, grains)
    pause = pause_of(spec)
    looks = round(spec.numerics.max_time_s / pause) + 2
    flow = words("family").flow(looks, bed.steps(spec, pause), outflow.QUIET)
    return text + code.remove(walls, "gate") + flow


class _Outflow:
    """What a run printed, where `outflow.watch` takes a `Simulation`."""

    def __init__(self, spec, grains, output):
        self.time, self.time_step = 0.0, time_step_of(spec)
        rows = re.findall(r"^left (\d+) (\S+)", output, re.MULTILINE)
        self.rows = iter([(int(n), float(mass)) for n, mass in rows])
        self.n, self.mass, self.left = grains.n, grains.mass, float(grains.mass.sum())
        self.gone = 0.0

    def advance(self, steps):
        """To the next look."""
        self.time += steps * self.time_step
        before = self.left
        self.n, self.left = next(self.rows, (self.n, self.left))
        self.gone = max(before - self.left, 0.0)


def read(spec: RunSpec, folder: Path, output: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Metrics and last state of a run in `folder`. Raises EngineError, MeasureError. The state is
    as `program.state_of` gives it."""
    silo, density = own.Silo(spec.geometry), spec.materials.particle.density_kg_m3
    full = bed.Grains(density, state_of(read_dump(folder / "settled.dump")))
    end = folder / "end.dump"
    state = NO_GRAINS if re.search(r"^left 0 ", output, re.MULTILINE) else state_of(read_dump(end))
    rest, flow = bed.Grains(density, state), _Outflow(spec, full, output)
    times, masses = outflow.watch(flow, spec, lambda: flow.gone)  # type: ignore[arg-type]  # arrays stand in for it
    bulk, rate = own.bulk_density(full, spec, silo), outflow.steady_flow(times, masses)  # type: ignore[arg-type]  # arrays stand in for it
    law = beverloo(bulk, 2.0 * silo.orifice, 2.0 * mean_radius(spec))
    return {
        "mass_flow_g_s": 1e3 * rate,
        "beverloo_constant": rate / law,
        "emptying_time_s": outflow.ended(times, masses),
        "discharged_share": float(masses[-1] / full.mass.sum()),
        "arched": int(own.is_arched(rest, silo, spec)),  # type: ignore[arg-type]  # arrays stand in for it
        "drained_angle_deg": own.drained_angle(rest, silo, spec),  # type: ignore[arg-type]  # arrays stand in for it
        "bulk_density_kg_m3": bulk,
    }, state
