"""The cases: what the benchmark prescribes, its files as they are given out, what is watched."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dem.contact.registry import ContactParameters, Material
from dem.errors import DemError

POISSON = 0.2


def _material(density, young):
    return Material(density, young / (2.0 * (1.0 + POISSON)), POISSON)


MATERIALS = {
    "M1": _material(2500.0, 1.0e9),
    "M2": _material(2000.0, 0.5e9),
    "steel": _material(7200.0, 210.0e9),
}
CONTACTS = {
    ("M1", "M1"): ContactParameters(0.5, 0.3),
    ("M1", "M2"): ContactParameters(0.45, 0.2),
    ("M2", "M2"): ContactParameters(0.4, 0.4),
    ("M1", "steel"): ContactParameters(0.4, 0.2),
    ("M2", "steel"): ContactParameters(0.4, 0.2),
    ("steel", "steel"): ContactParameters(0.6, 0.5),
}
"""Restitution and friction of each pair, as the scripts of MercuryDPM and YADE have them."""

COARSE = 2e-3
"""Radius [m] of M2 in the drum."""
DRUM_SPIN = 2.0
"""Speed of the drum [rad/s] about -y: counterclockwise for who looks along +y."""
INTRUDER = 1e-2, 0.06, 5.0
"""Radius [m], height of its centre [m] and speed [m/s] of the sphere that falls into a bed."""


LOOKS = 200
"""Looks at a case over its prescribed duration."""


@dataclass(frozen=True)
class Group:
    """Grains of one material: radius (n,) [m], position (n, 3) [m], velocity (3,) [m/s]."""

    material: str
    radius: np.ndarray
    position: np.ndarray
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Case:
    """One case.

    name : of the case
    groups : its grains, numbered through in this order
    triangles : (t, 3, 3) [m] of the walls, which are of steel
    time_step, duration : [s], as prescribed
    until : time at which a run ends [s], at the duration unless shortened
    watch : (position (n, 3) [m], number of each grain (n,)) -> {column: value}, of the grains
    spin : of the walls about +y [rad/s]
    box : (half x, half y, bottom) [m] of the box that the triangles stand for, if they do
    regions : the surfaces that they stand for otherwise, as LAMMPS takes them
    """

    name: str
    groups: tuple[Group, ...]
    triangles: np.ndarray
    time_step: float
    duration: float
    watch: Callable[[np.ndarray, np.ndarray], dict[str, float]]
    spin: float = 0.0
    box: tuple[float, float, float] | None = None
    regions: tuple[str, ...] = ()
    until: float = math.inf

    @property
    def grains(self) -> int:
        """Number of grains at the start."""
        return sum(len(group.radius) for group in self.groups)

    @property
    def materials(self) -> list[str]:
        """Names of the materials: those of the grains in order, and steel at the end."""
        names = dict.fromkeys(group.material for group in self.groups)
        return [*(name for name in names if name != "steel"), "steel"]

    def shortened(self, seconds: float) -> Case:
        """The same case for no longer than so many seconds of simulated time."""
        return replace(self, until=seconds)

    def moved(self, distance: float) -> Case:
        """The same case with the grains of its last group so far along x [m]."""
        *others, last = self.groups
        place = last.position + np.array([distance, 0.0, 0.0])
        return replace(self, groups=(*others, replace(last, position=place)))

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
    wide, height, speed = INTRUDER
    grains = len(radius)

    def watch(position, number):
        return {"height_m": float(position[number == grains, 2][0])}

    # half widths and bottom of the box within walls that have a thickness
    x, y, z = triangles.reshape(-1, 3).T
    box = float(np.abs(x).min()), float(np.abs(y).min()), float(np.unique(np.round(z, 9))[1])
    sphere = Group("steel", np.array([wide]), np.array([[0.0, 0.0, height]]), (0.0, 0.0, -speed))
    groups = Group("M1", radius, position), sphere
    return Case("penetration-25K", groups, triangles, 5e-7, 0.1, watch, box=box)


def drum(folder: Path) -> Case:
    """A drum turns grains of two sizes and materials."""
    radius, position, triangles = _given(folder / "Drum", "PartCoordinates.txt")
    coarse = radius == COARSE
    groups = (
        Group("M1", radius[~coarse], position[~coarse]),
        Group("M2", radius[coarse], position[coarse]),
    )
    fine = len(groups[0].radius)

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
    regions = (f"cylinder y 0 0 {inner:.6g} -0.03 0.03",)
    return Case("drum", groups, triangles, 8e-7, 5.0, watch, spin=-DRUM_SPIN, regions=regions)


CASES: dict[str, Callable[[Path], Case]] = {"penetration-25K": penetration, "drum": drum}
"""Name -> function of the folder of the benchmark's files."""
