"""The cases: what the benchmark prescribes, and its files as they are given out."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from dem.contact.registry import ContactParameters, Material

PRESCRIBED = yaml.safe_load(Path(__file__).with_name("prescribed.yaml").read_text())


def _material(density, young):
    poisson = PRESCRIBED["poisson"]
    return Material(density, young / (2.0 * (1.0 + poisson)), poisson)


MATERIALS = {name: _material(**own) for name, own in PRESCRIBED["materials"].items()}
CONTACTS: dict[tuple[str, str], ContactParameters] = {
    tuple(pair.split()): ContactParameters(**own) for pair, own in PRESCRIBED["contacts"].items()
}
LOOK = 1000
"""Steps from one look at a case to the next."""


@dataclass(frozen=True)
class Case:
    """One case.

    name : of the case
    material (n,), radius (n,) [m], position, velocity (n, 3) [m], [m/s] : of its grains, those of
        a material one after another
    triangles : (t, 3, 3) [m] of the walls, which are of steel
    regions : the surfaces that the triangles stand for, as LAMMPS takes them
    time_step : [s], as prescribed
    looks : at which it ends, LOOK steps each
    spin : of the walls about +y [rad/s]
    """

    name: str
    material: np.ndarray
    radius: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    triangles: np.ndarray
    regions: tuple[str, ...]
    time_step: float
    looks: int
    spin: float = 0.0

    @property
    def materials(self) -> list[str]:
        """Names of the materials: those of the grains in order, and steel at the end."""
        names = dict.fromkeys(map(str, self.material))
        return [*(name for name in names if name != "steel"), "steel"]

    def moved(self, distance: float) -> "Case":
        """The same case with the grains of its last material so far along x [m]."""
        along = np.array([distance, 0.0, 0.0])
        last = self.material[:, None] == self.material[-1]
        return replace(self, position=np.where(last, self.position + along, self.position))


def read_numbers(path: Path, columns: int) -> np.ndarray:
    """Rows of numbers of one of the benchmark's files (n, columns). The beds end with a row of
    another length, which is the sphere's and is left out."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    return np.array([row for row in rows if len(row) == columns], float)


def _given(folder, spheres):
    """(radius (n,), position (n, 3), triangles (t, 3, 3)) of a case's folder."""
    table, walls = read_numbers(folder / spheres, 4), read_numbers(folder / "walls.txt", 9)
    return table[:, 0], table[:, 1:], walls.reshape(-1, 3, 3)


def penetration(folder: Path) -> Case:
    """A steel sphere falls into a bed of grains of 2 mm in a box."""
    radius, position, triangles = _given(folder / "Penetration", "25KParticles.txt")
    given = PRESCRIBED["penetration"]
    # half widths and bottom of the box within walls that have a thickness
    x, y, z = triangles.reshape(-1, 3).T
    wide_x, wide_y, bottom = np.abs(x).min(), np.abs(y).min(), np.unique(np.round(z, 9))[1]
    box = f"{-wide_x:.9g} {wide_x:.9g} {-wide_y:.9g} {wide_y:.9g} {bottom:.9g} {z.max():.9g}"
    material = np.append(np.full(len(radius), "M1"), "steel")
    radius = np.append(radius, given["radius"])
    position = np.vstack([position, [0.0, 0.0, given["height"]]])
    velocity = np.zeros_like(position)
    velocity[-1, 2] = -given["speed"]
    return Case(
        "penetration-25K", material, radius, position, velocity, triangles,
        (f"block {box} open 6",), given["time_step"], given["looks"],
    )  # fmt: skip


def drum(folder: Path) -> Case:
    """A drum turns grains of two sizes and materials."""
    radius, position, triangles = _given(folder / "Drum", "PartCoordinates.txt")
    given = PRESCRIBED["drum"]
    order = np.argsort(radius == given["coarse"], kind="stable")
    radius, position = radius[order], position[order]
    material = np.where(radius == given["coarse"], "M2", "M1")
    corners = triangles.reshape(-1, 3)
    inner = float(np.hypot(corners[:, 0], corners[:, 2])[np.abs(corners[:, 1]) <= 0.03].min())
    return Case(
        "drum", material, radius, position, np.zeros_like(position), triangles,
        (f"cylinder y 0 0 {inner:.6g} -0.03 0.03",), given["time_step"], given["looks"],
        -given["spin"],
    )  # fmt: skip
