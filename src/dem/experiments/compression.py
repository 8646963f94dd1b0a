"""Confined compression and unconfined strength: a lid presses grains in a square box; then the
walls are taken away.

The lid comes down at a steady speed until it carries the load (oedometer). When the walls are gone,
it goes on pressing. The largest stress that the bed carries then is the unconfined strength. It is
nil for grains that do not attract each other.
"""

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from dem.errors import MeasureError
from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.experiments.mesh import outside, read_mesh
from dem.grains.sizes import draw_radii, grain_volume, largest_reach, longest_mm, smallest_radius
from dem.linear import slope
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec

LEAST_WIDTH = 5.0  # of the largest grain
LOOK = 1e-4  # path of the lid between looks, over the depth
MEAN = 20  # looks over which the strength is a mean: single grains that jump do not count
DENSE, LOOSE = 0.7, 0.5  # solid fractions between which beds of spheres lie
UPPER = 0.3  # share of the load from which on modulus and exponent are read


class CompressionGeometry(Part):
    """Box, lid and load."""

    box_width_mm: float = field(16.0, "side of the square box", gt=0)
    box_height_mm: float = field(45.0, "rim of the box, from which the lid comes down", gt=0)
    lid_travel_mm: float = field(40.0, "longest way of the lid below the rim", gt=0)
    normal_stress_kPa: float = field(20.0, "load at which compression ends", gt=0)
    seating_stress_kPa: float = field(0.2, "load from which on strain counts", gt=0)
    press_speed_mm_s: float = field(20.0, "speed of the lid", gt=0)
    unconfined_strain: float = field(
        0.1, "way of the lid after the walls are gone, over the depth", gt=0, lt=0.5
    )
    lid_stl: str | None = mesh_field(
        "mesh [mm] of a punch in place of the flat lid: its lowest points at z = 0, and as wide as "
        "the box about x = y = 0 but for less than the smallest grain's radius on each side"
    )
    packing: Literal["poured", "cubic"] = field(
        "poured", "poured, or grain on grain in a square lattice, which has a closed form"
    )


def check(spec: "RunSpec") -> None:
    """Grains must lie side by side, the box must take them and the lid must reach them."""
    g = spec.geometry
    refuse_narrow("box_width_mm", spec, LEAST_WIDTH)
    solid = 1e9 * spec.particles.count * grain_volume(spec) / g.box_width_mm**2
    if g.box_height_mm < solid / LOOSE:
        refuse("box_height_mm", spec, f"at least {solid / LOOSE:.3g}, which the grains need")
    depth = solid / DENSE
    if g.box_height_mm - g.lid_travel_mm > depth:
        allowed = f"at least {g.box_height_mm - depth:.3g}: the bed is {depth:.3g} mm deep"
        refuse("lid_travel_mm", spec, f"{allowed} and the lid cannot reach it")
    if g.seating_stress_kPa >= g.normal_stress_kPa:
        refuse("seating_stress_kPa", spec, f"less than the load ({g.normal_stress_kPa:g} kPa)")
    side, p = g.box_width_mm / longest_mm(spec), spec.particles
    alike = p.sizes is None and p.clump is None and p.elongation == 1.0
    whole = alike and abs(side - round(side)) < 1e-6 and p.count % round(side) ** 2 == 0
    if g.packing == "cubic" and not whole:
        allowed = "poured; cubic takes equal spheres that fill whole layers of the box"
        refuse("packing", spec, allowed)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, compress, take the walls away, press on; returns the metrics."""
    g, area = spec.geometry, (1e-3 * spec.geometry.box_width_mm) ** 2
    sim = _filled(spec, np.random.default_rng(spec.seed))
    context.progress(0.4, "filled")
    press = _Press(sim, area, 1e-3 * g.press_speed_mm_s)
    lowest = 1e-3 * (g.box_height_mm - g.lid_travel_mm)
    heights, stresses = press.down_to(1e3 * g.normal_stress_kPa, lowest)
    context.progress(0.7, "compressed")
    sides = sum(sim.wall_force(f"side{k}")[axis] * sign for k, (axis, sign) in enumerate(SIDES))
    mean_side = sides / (4.0 * 1e-3 * g.box_width_mm * heights[-1])
    found = _curve(heights, stresses, 1e3 * g.seating_stress_kPa)
    solid = float(4.0 / 3.0 * math.pi * sim.cubed_radius.sum()) / (area * heights[-1])
    while press.step(press.speed) > 0.0:  # up, until the lid carries nothing
        pass
    for k in range(4):
        setup.take_away(sim, f"side{k}")
    strength = press.strongest(g.unconfined_strain * heights[-1])
    context.finish(sim)
    return found | {
        "wall_stress_ratio": float(mean_side / stresses[-1]),
        "compressed_solid_fraction": solid,
        "unconfined_strength_kPa": 1e-3 * strength,
        "depth_mm": 1e3 * float(heights[-1]),
    }


SIDES = ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))  # axis of each wall's normal, side of the box


def _filled(spec, rng):
    half = 0.5e-3 * spec.geometry.box_width_mm
    if spec.geometry.packing == "poured":
        return bed.poured(spec, lambda top: _walls(spec, half, top), (half, half), 0.0, rng)
    reach, radii = largest_reach(spec), draw_radii(spec, spec.particles.count, rng)
    sites = bed.sites_in_rectangle((-half, -half), (half, half), reach, rng)
    top = bed.highest_site(len(radii), sites, 0.0, reach)
    sim = setup.build_simulation(spec, _walls(spec, half, top))
    # grain on grain, touching each other, floor and walls
    across = round(half / radii[0])
    place = (2.0 * np.arange(across) + 1.0) * half / across - half
    layer, rest = np.divmod(np.arange(len(radii)), across**2)
    row, column = np.divmod(rest, across)
    high = radii[0] * (2.0 * layer + 1.0)
    sim.add_particles(np.column_stack([place[row], place[column], high]), radii)
    bed.advance_for(sim, 2.0 * phases.look(spec))
    return sim


def _punch(spec):
    """`Mesh` of the lid; None for a flat one."""
    half = 0.5e-3 * spec.geometry.box_width_mm
    least = half - smallest_radius(spec)
    low, high = np.array([-least, -least]), np.array([least, least])
    mesh = read_mesh(spec, "lid_stl", outside(low, high))
    if mesh is None:
        return None
    mesh.topped(low, high, "its underside", side=-1.0)
    widest = float(np.abs(mesh.vertices[:, :2]).max())
    if widest > half + mesh.slack:
        found = f"reaches {1e3 * widest:.4g} mm from the middle, into the walls of the box"
        mesh.refuse(f"{found}; allowed: {1e3 * half:.4g} mm")
    return mesh


def _walls(spec, half, top):
    high = max(top, 1e-3 * spec.geometry.box_height_mm)
    walls = builder.WallSet().body("floor", material=setup.WALL).plane((0, 0, 0), (0, 0, 1))
    up = np.array([0.0, 0.0, 0.5 * high])
    for k, (axis, sign) in enumerate(SIDES):
        out, along = np.zeros(3), np.zeros(3)
        out[axis], along[1 - axis] = sign * half, half
        walls.body(f"side{k}", material=setup.WALL).rectangle(out + up, along, up)
    walls.body("lid", material=setup.WALL, origin=(0.0, 0.0, 2.0 * high))
    mesh = _punch(spec)
    if mesh:
        return walls.mesh(*mesh.body)
    return walls.rectangle((0, 0, 0), (half, 0, 0), (0, half, 0))


class _Press:
    """The lid, which moves at a steady speed and feels the grains."""

    def __init__(self, sim, area, speed):
        self.sim, self.area, self.speed = sim, area, speed
        top = float((sim.position[:, 2] + sim.radius).max())
        sim.wall_state.origin[sim.walls.index("lid"), 2] = top
        self.look, self.velocity = LOOK * top / speed, 0.0

    def step(self, speed: float) -> float:
        """Mean stress [Pa] on the lid while it moves upwards at a speed [m/s] for a look."""
        if speed != self.velocity:  # a wall that is given a speed asks for new lists
            self.sim.move_wall("lid", velocity=(0.0, 0.0, speed))
            self.velocity = speed
        return bed.force_on(self.sim, "lid", self.look)[2] / self.area

    def down_to(self, load: float, lowest: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights [m] of the lid, in the middle of each look, and stresses [Pa] until it carries
        `load`."""
        heights, stresses = [], [0.0]
        while stresses[-1] < load:
            before = self.sim.wall_origin("lid")[2]
            stresses.append(self.step(-self.speed))
            after = self.sim.wall_origin("lid")[2]
            heights.append(0.5 * (before + after))
            if after < lowest:
                ended = f"the end of its travel at {1e-3 * stresses[-1]:.3g} kPa"
                raise MeasureError(f"the lid came to {ended}: raise geometry.lid_travel_mm")
        return np.array(heights), np.array(stresses[1:])

    def strongest(self, path: float) -> float:
        """Largest stress [Pa] on the way down by `path` [m], as a mean over some looks."""
        looks = max(round(path / (self.speed * self.look)), MEAN)
        found = np.cumsum([0.0] + [self.step(-self.speed) for _ in range(looks)])
        return float(max((found[MEAN:] - found[:-MEAN]).max() / MEAN, 0.0))


def _curve(heights, stresses, seat):
    """Return what the loading curve says; strain from the height at the seating stress on."""
    first = int(np.argmax(stresses >= seat))
    strain = (heights[first] - heights) / heights[first]
    upper = (stresses > UPPER * stresses[-1]) & (strain > 0.0)
    if upper.sum() < 3:
        raise MeasureError("the load came at once: lower geometry.press_speed_mm_s")
    return {
        "strain_at_load": float(strain[-1]),
        "constrained_modulus_kPa": 1e-3 * slope(strain[upper], stresses[upper]),
        "compression_exponent": slope(np.log(strain[upper]), np.log(stresses[upper])),
    }


EXPERIMENT = Experiment(
    name="compression",
    title="Confined compression and unconfined strength",
    geometry=CompressionGeometry,
    run=run,
    metrics=(
        Metric("strain_at_load", "strain under the load, from the seating stress on", 0.0, 1.0),
        Metric("constrained_modulus_kPa", "slope of stress over strain near the load", 0.0),
        Metric("compression_exponent", "slope of their logarithms near the load", target=False),
        Metric("wall_stress_ratio", "stress on the walls over that on the lid"),
        Metric("compressed_solid_fraction", "of the box, under the load", 0.0, 1.1),
        Metric("unconfined_strength_kPa", "most that the lid carries without walls", 0.0),
        Metric("depth_mm", "depth of the bed under the load", 0.0, target=False),
    ),
    defaults={
        "particles": {"count": 1000},
        "numerics": {"max_time_s": 2.0, "rayleigh_fraction": 0.2},
    },
    check=check,
    prepare=_punch,  # an unusable mesh is refused here
    poured=True,
    quantity=Quantity("constrained_modulus", "kPa", 1e-3, 1e7, "constrained modulus", True),
    levers=lever("normal_stress_kPa", 1e-3, 1e4, "normal stress", needed=True),
    mechanisms=("cohesion",),
)
