"""Direct shear in a ring: a trough of grains turns under a lid that carries the normal load and
holds still.

A ring closes on itself, so no grain is pinched between the halves of a box and the sheared length
has no end. Vanes on the lid and on the floor keep the grains from slipping there. The shear zone
forms below the lid's vanes. The shear stress is the torque on the lid over its area's first moment
(Schulze 2008, Powders and Bulk Solids, section 4.2). As on the bench, the sample is compacted,
sheared to steady state under the pre-shear load, relieved, and sheared under the test load. The
peak is the point of the yield locus.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dem.constants import GRAVITY
from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import LOAD, Experiment, Metric, Quantity, lever, refuse
from dem.experiments.mesh import Mesh, annulus, read_mesh
from dem.grains.sizes import draw_radii, fall_time, largest_reach, longest_mm, smallest_radius
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

VANES = 24
RAMP = 4.0  # duration of a change of load, in fall times of the mean grain
PITCH = 2.1  # between grains when they are made, in reaches
STRETCHES = 50  # the shear path is cut into so many means
SHAKE = 5.0  # speed of the grains at the start, of sqrt(g reach): it breaks their lattice
FILLED, PRESSED, RELIEVED = 150.0, 90.0, 60.0  # fall times that the grains get to rest, at most


class ShearGeometry(Part):
    """Ring shear cell."""

    inner_diameter_mm: float = field(20.0, "inner wall of the ring", gt=0)
    outer_diameter_mm: float = field(44.0, "outer wall of the ring", gt=0)
    normal_stress_kPa: float = field(2.0, "test load", gt=0)
    preshear_normal_stress_kPa: float | None = field(
        None, "pre-shear load; the test load unless given", gt=0
    )
    shear_speed_mm_s: float = field(30.0, "speed of the trough at the mean radius", gt=0)
    preshear_displacement_mm: float = field(4.0, "pre-shear path at the mean radius", gt=0)
    shear_displacement_mm: float = field(6.0, "shear path at the mean radius", gt=0)
    lid_stl: str | None = mesh_field(
        "mesh [mm] of the lid with its vanes: about the z axis, as wide as the ring, its underside "
        "at z = 0 and the vanes below"
    )
    floor_stl: str | None = mesh_field(
        "mesh [mm] of the trough's floor with its vanes: about the z axis, as wide as the ring, "
        "the floor at z = 0 and the vanes above; the walls are the keys'"
    )


def check(spec: "RunSpec") -> None:
    """The ring must be wide enough for grains to pass each other."""
    g, largest = spec.geometry, longest_mm(spec)
    needed = g.inner_diameter_mm + 4.0 * largest
    if g.outer_diameter_mm < needed:
        allowed = f"at least {needed:g}: a gap of two of the largest grain ({largest:g} mm)"
        refuse("outer_diameter_mm", spec, allowed)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Shear at one normal stress; returns the metrics of docs/architecture.md."""
    g = spec.geometry
    cell = Ring(spec, np.random.default_rng(spec.seed))
    context.progress(0.05, "filling")
    phases.rest(cell.sim, spec, FILLED * cell.fall_time, "filling")
    cell.load(g.preshear_normal_stress_kPa or g.normal_stress_kPa)
    phases.rest(cell.sim, spec, PRESSED * cell.fall_time, "pressing")
    context.progress(0.3, "pre-shear")
    preshear, _ = cell.shear(1e-3 * g.preshear_displacement_mm)
    cell.load(g.normal_stress_kPa)
    phases.rest(cell.sim, spec, RELIEVED * cell.fall_time, "relieving")
    density = float(cell.sim.mass.sum()) / (cell.sim.wall_origin("lid")[2] * cell.area)
    context.progress(0.6, "shear")
    curve, normal = cell.shear(1e-3 * g.shear_displacement_mm)
    context.finish(cell.sim)
    late = curve[STRETCHES // 2 :]
    # the peak of a mean over a tenth of the path: single spikes are grains caught at a vane
    smooth = sliding_window_view(curve, STRETCHES // 10).mean(axis=1)
    return {
        "shear_stress_kPa": float(smooth.max()),
        "steady_shear_stress_kPa": float(late.mean()),
        "steady_shear_stress_sd_kPa": float(late.std(ddof=1)),
        "preshear_stress_kPa": float(preshear[STRETCHES // 2 :].mean()),
        "normal_stress_kPa": float(normal),
        "bulk_density_kg_m3": float(density),
    }


def meshes(spec: "RunSpec") -> "list[Mesh | None]":
    """`Mesh` of the lid and of the floor; None for one with plain vanes."""
    g, found, gap = spec.geometry, [], smallest_radius(spec)
    inner, outer = 0.5e-3 * g.inner_diameter_mm, 0.5e-3 * g.outer_diameter_mm
    for key, side in (("lid_stl", -1.0), ("floor_stl", 1.0)):
        mesh = read_mesh(spec, key)
        found.append(mesh)
        if mesh is None:
            continue
        plate = mesh.covering(annulus(inner + gap, outer - gap), "over the ring its surface", side)
        mesh.in_place("its surface between the vanes", (side * plate).min(), 0.0)
        out = float(np.hypot(*mesh.vertices[:, :2].T).max())
        if out > outer + mesh.slack:
            most = f"{1e3 * outer:.4g} mm, the outer wall"
            mesh.refuse(f"reaches {1e3 * out:.4g} mm from the axis; allowed: {most}")
    return found


class Ring:
    """Trough, lid and grains."""

    def __init__(self, spec: "RunSpec", rng: np.random.Generator) -> None:
        self.spec, g = spec, spec.geometry
        self.inner, self.outer = 0.5e-3 * g.inner_diameter_mm, 0.5e-3 * g.outer_diameter_mm
        self.area = math.pi * (self.outer**2 - self.inner**2)
        # of the area about the axis [m3]
        self.moment = 2.0 / 3.0 * math.pi * (self.outer**3 - self.inner**3)
        self.rate = 1e-3 * g.shear_speed_mm_s / (0.5 * (self.inner + self.outer))
        radii = draw_radii(spec, spec.particles.count, rng)
        self.fall_time, reach = fall_time(spec), largest_reach(spec)
        self.lid, self.floor = meshes(spec)
        self.sim = setup.build_simulation(spec, self.build_walls(spec, reach))
        bed.lay_lid(self.sim, spec, self.fill(spec, radii, reach, rng))

    def build_walls(self, spec: "RunSpec", r: float) -> "WallSet":
        """`WallSet` of trough and lid for grains that reach `r` [m]."""
        walls, plate = builder.WallSet(), (self.inner, 0.0, self.outer, 0.0)
        walls.body("trough", material=setup.WALL)
        walls.mesh(*self.floor.body) if self.floor else walls.revolved(*plate)
        for radius in (self.inner, self.outer):
            walls.cylinder(radius, 0.0, self.height(spec, r))
        if self.floor is None:
            self._vanes(walls, 0.0, 2.0 * r)
        free = {"mass": 1.0, "axis": (0, 0, 1), "load": 0.0}
        walls.body("lid", material=setup.WALL, free=free)
        if self.lid:
            return walls.mesh(*self.lid.body)
        self._vanes(walls.revolved(*plate), -2.0 * r, 0.0)
        return walls

    def _vanes(self, walls, low, high):
        middle, half = 0.5 * (self.inner + self.outer), 0.5 * (self.outer - self.inner)
        for turn in np.arange(VANES) * 2.0 * math.pi / VANES:
            out = np.array([math.cos(turn), math.sin(turn), 0.0])
            centre = middle * out + (0.0, 0.0, 0.5 * (low + high))
            walls.rectangle(centre, 0.999 * half * out, (0.0, 0.0, 0.5 * (high - low)))

    def fill(self, spec: "RunSpec", radii: np.ndarray, r: float, rng: np.random.Generator) -> float:
        """Rings of grains, layer on layer, above the floor's vanes; returns the height of the lid
        [m]. radii (n,), r: largest reach [m]."""
        site = self._sites(r)
        place = np.arange(len(radii)) % len(site)
        z = self._heights(spec, r)
        speed = SHAKE * math.sqrt(GRAVITY * r)
        velocity = rng.uniform(-speed, speed, (len(radii), 3))
        setup.add_grains(self.sim, spec, np.column_stack([site[place], z]), radii, velocity, rng)
        return z.max() + (2.0 * r - self.lid.low if self.lid else 4.0 * r)

    def _sites(self, r):
        """Rings of places (k, 2) for grains that reach `r` [m]."""
        site = []
        for ring in np.arange(self.inner + 1.05 * r, self.outer - 1.0 * r, PITCH * r):
            count = int(2.0 * math.pi * ring / (PITCH * r))
            turn = 2.0 * math.pi * np.arange(count) / count
            site.append(np.column_stack([ring * np.cos(turn), ring * np.sin(turn)]))
        return np.vstack(site)

    def _heights(self, spec, r):
        """Height (n,) at which each grain is made, above the floor's vanes [m]."""
        layer = np.arange(spec.particles.count) // len(self._sites(r))
        return (self.floor.high + 1.1 * r if self.floor else 3.1 * r) + PITCH * r * layer

    def height(self, spec: "RunSpec", r: float) -> float:
        """Height of the walls, which no grain reaches however it was thrown [m]."""
        return self._heights(spec, r).max() + (SHAKE**2 + 4.0) * r

    def load(self, stress_kPa: float) -> None:
        """Put the lid under a normal stress; its own weight counts."""
        lid = self.sim.walls.index("lid")
        weight = self.sim.wall_state.mass[lid] * GRAVITY
        wanted, now = weight - 1e3 * stress_kPa * self.area, self.sim.wall_state.load[lid]
        # in steps: dropped at once, the lid would strike the grains
        for part in np.linspace(0.0, 1.0, 21)[1:]:
            self.sim.move_wall("lid", load=now + part * (wanted - now))
            bed.advance_for(self.sim, RAMP / 20 * self.fall_time)

    def shear(self, path: float) -> tuple[np.ndarray, float]:
        """Turn the trough so that the mean radius travels `path` [m]; returns shear stress
        (STRETCHES,) and normal stress [kPa]."""
        sim, speed = self.sim, self.rate * 0.5 * (self.inner + self.outer)
        steps = max(round(path / speed / sim.time_step / STRETCHES), 1)
        sim.move_wall("trough", spin=(0.0, 0.0, self.rate))
        stress, span = [], steps * sim.time_step
        press = sim.wall_impulse("lid")[2]
        for _ in range(STRETCHES):
            twist = sim.wall_angular_impulse("lid")[2]
            sim.advance(steps)
            torque = (sim.wall_angular_impulse("lid")[2] - twist) / span
            stress.append(1e-3 * torque / self.moment)
        normal = (sim.wall_impulse("lid")[2] - press) / (span * STRETCHES) / self.area * 1e-3
        sim.move_wall("trough", spin=(0.0, 0.0, 0.0))
        return np.array(stress), normal


EXPERIMENT = Experiment(
    name="shear",
    title="Direct shear in a ring",
    geometry=ShearGeometry,
    run=run,
    metrics=(
        Metric("shear_stress_kPa", "peak of the shear stress under the test load"),
        Metric("steady_shear_stress_kPa", "its mean over the second half of the path"),
        Metric("steady_shear_stress_sd_kPa", "its scatter there", 0.0, target=False),
        Metric("preshear_stress_kPa", "steady stress under the pre-shear load", target=False),
        Metric("normal_stress_kPa", "what the lid pressed with", target=False),
        Metric("bulk_density_kg_m3", "mass over volume between floor and lid", 0.0),
    ),
    defaults={"numerics": {"rayleigh_fraction": 0.2}},
    check=check,
    prepare=meshes,  # an unusable mesh is refused here
    poured=True,
    quantity=Quantity("shear_stress", "kPa", 1e-4, 1e4, "shear stress", relative=True, scale=LOAD),
    levers=lever("normal_stress_kPa", 1e-3, 1e4, "normal stress", needed=True),
)
