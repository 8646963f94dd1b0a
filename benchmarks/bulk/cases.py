"""The cases: what the benchmark prescribes, its files as they are given out, what is watched."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from dem.contact.registry import ContactParameters, Material
from dem.errors import DemError

PRESCRIBED = yaml.safe_load(Path(__file__).with_name("prescribed.yaml").read_text())


def _material(density, young):
    poisson = PRESCRIBED["poisson"]
    return Material(density, young / (2.0 * (1.0 + poisson)), poisson)


MATERIALS = {name: _material(**own) for name, own in PRESCRIBED["materials"].items()}
CONTACTS: dict[tuple[str, str], ContactParameters] = {
    tuple(pair.split()): ContactParameters(**own) for pair, own in PRESCRIBED["contacts"].items()
}
LOOKS = 200
"""Looks at a case over its prescribed duration."""


@dataclass(frozen=True)
class Case:
    """One case.

    name : of the case
    material (n,), radius (n,) [m], position, velocity (n, 3) [m], [m/s] : of its grains, those of
        a material one after another
    triangles : (t, 3, 3) [m] of the walls, which are of steel
    time_step, duration : [s], as prescribed
    until : time at which a run ends [s], at the duration unless shortened
    watch : (position (n, 3) [m], number of each grain (n,)) -> {column: value}, of the grains
    spin : of the walls about +y [rad/s]
    regions : the surfaces that the triangles stand for, as LAMMPS takes them
    """

    name: str
    material: np.ndarray
    radius: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    triangles: np.ndarray
    time_step: float
    duration: float
    watch: Callable[[np.ndarray, np.ndarray], dict[str, float]]
    spin: float = 0.0
    regions: tuple[str, ...] = ()
    until: float = math.inf

    @property
    def grains(self) -> int:
        """Number of grains at the start."""
        return len(self.radius)

    @property
    def materials(self) -> list[str]:
        """Names of the materials: those of the grains in order, and steel at the end."""
        names = dict.fromkeys(map(str, self.material))
        return [*(name for name in names if name != "steel"), "steel"]

    def shortened(self, seconds: float) -> Case:
        """The same case for no longer than so many seconds of simulated time."""
        return replace(self, until=seconds)

    def moved(self, distance: float) -> Case:
        """The same case with the grains of its last material so far along x [m]."""
        along = np.array([distance, 0.0, 0.0])
        last = self.material[:, None] == self.material[-1]
        return replace(self, position=np.where(last, self.position + along, self.position))

    @property
    def looks(self) -> tuple[int, int]:
        """(steps from one look at it to the next, number of looks)."""
        steps = round(min(self.until, self.duration) / self.time_step)
        between = max(min(round(self.duration / self.time_step / LOOKS), steps), 1)
        return between, steps // between


def read_numbers(path: Path, columns: int) -> np.ndarray:
    """Rows of numbers of one of the benchmark's files (n, columns). The beds end with a row of
    another length, which is the sphere's and is left out. Raises DemError for a file that is not
    there, and for a row that is no numbers."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as fault:
        raise DemError(
            f"{path}: {fault.strerror}; the files stand in MercuryDPM's repository under "
            "Drivers/Papers/OSBenchmark"
        ) from None
    rows = []
    for number, line in enumerate(lines[1:], 2):
        words = line.split()
        if len(words) != columns and (not words or number >= len(lines) - 2):
            continue
        try:
            rows.append(np.array(words, float).reshape(columns))
        except ValueError:
            raise DemError(f"{path}, line {number}: {line!r}; allowed: {columns} numbers") from None
    return np.array(rows)


def _given(folder, spheres):
    """(radius (n,), position (n, 3), triangles (t, 3, 3)) of a case's folder."""
    table, walls = read_numbers(folder / spheres, 4), read_numbers(folder / "walls.txt", 9)
    return table[:, 0], table[:, 1:], walls.reshape(-1, 3, 3)


def penetration(folder: Path) -> Case:
    """A steel sphere falls into a bed of grains of 2 mm in a box."""
    radius, position, triangles = _given(folder / "Penetration", "25KParticles.txt")
    given, grains = PRESCRIBED["penetration"], len(radius)

    def watch(position, number):
        return {"height_m": float(position[number == grains, 2][0])}

    # half widths and bottom of the box within walls that have a thickness
    x, y, z = triangles.reshape(-1, 3).T
    wide_x, wide_y, bottom = np.abs(x).min(), np.abs(y).min(), np.unique(np.round(z, 9))[1]
    box = f"{-wide_x:.9g} {wide_x:.9g} {-wide_y:.9g} {wide_y:.9g} {bottom:.9g} {z.max():.9g}"
    material = np.append(np.full(grains, "M1"), "steel")
    radius = np.append(radius, given["radius"])
    position = np.vstack([position, [0.0, 0.0, given["height"]]])
    velocity = np.zeros_like(position)
    velocity[-1, 2] = -given["speed"]
    return Case(
        "penetration-25K", material, radius, position, velocity, triangles, given["time_step"],
        given["duration"], watch, regions=(f"block {box} open 6",),
    )  # fmt: skip


def drum(folder: Path) -> Case:
    """A drum turns grains of two sizes and materials."""
    radius, position, triangles = _given(folder / "Drum", "PartCoordinates.txt")
    given = PRESCRIBED["drum"]
    order = np.argsort(radius == given["coarse"], kind="stable")
    radius, position = radius[order], position[order]
    material = np.where(radius == given["coarse"], "M2", "M1")
    fine = int((material == "M1").sum())

    def watch(position, number):
        x, z = position[:, 0], position[:, 2]
        zones = {"upper": (x > 0) & (z > 0), "lower": (x < 0) & (z < 0)}
        return {
            f"{zone}_{name}": int((inside & of).sum())
            for zone, inside in zones.items()
            for name, of in (("M1", number < fine), ("M2", number >= fine))
        }

    corners = triangles.reshape(-1, 3)
    inner = float(np.hypot(corners[:, 0], corners[:, 2])[np.abs(corners[:, 1]) <= 0.03].min())
    return Case(
        "drum", material, radius, position, np.zeros_like(position), triangles, given["time_step"],
        given["duration"], watch, -given["spin"], (f"cylinder y 0 0 {inner:.6g} -0.03 0.03",),
    )  # fmt: skip


CASES: dict[str, Callable[[Path], Case]] = {"penetration-25K": penetration, "drum": drum}
"""Name -> function of the folder of the benchmark's files."""
