"""A rotating drum with a horizontal axis: the angle of the moving surface over the speed of
rotation.

The drum turns about the z axis, and gravity points along -y. In the rolling regime a thin layer
flows down the surface, and the bed below turns with the drum as a solid. The Froude number w^2 R /
g decides the regime (Mellmann 2001, Powder Technology 118:251).
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.errors import MeasureError, SpecError
from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse_narrow
from dem.experiments.mesh import circle, read_mesh
from dem.grains.sizes import draw_radii, grain_volume, largest_reach, longest_mm, mean_radius
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

LEAST_DIAMETER, LEAST_WIDTH = 10.0, 3.0  # of the largest grain
LOOKS = 40  # while the angle is read
STRIPS = 16  # of the surface
CHORD = 0.6  # share of the drum's radius within which the surface is read
PASSIVE = 4.0  # mean diameters from the drum inwards that count as the passive bed
PACKING = 0.6
LEAST_CLEAR = 0.5  # of the drum's radius: lifters reach no further inwards
SHELL = "shell"  # the wall that turns


class DrumGeometry(Part):
    """Drum, speed and filling."""

    drum_diameter_mm: float = field(60.0, "inner diameter of the drum", gt=0)
    drum_width_mm: float = field(14.0, "inner width between the end plates", gt=0)
    rotation_rate_deg_s: float = field(90.0, "speed of rotation; 90 are 15 turns a minute", gt=0)
    start_turns: float = field(0.3, "turns before the angle is read", gt=0)
    turns: float = field(0.3, "turns over which it is read", gt=0)
    shell_stl: str | None = mesh_field(
        "mesh [mm] of the shell with its end plates, and lifters if there are any, in place of the "
        "smooth drum: about the z axis, end plates at z = 0 and drum_width_mm, and "
        "drum_diameter_mm wide inside where it is widest"
    )


def _filling(spec):
    """Share of the drum that the bed takes."""
    g = spec.geometry
    drum = math.pi * (0.5e-3 * g.drum_diameter_mm) ** 2 * 1e-3 * g.drum_width_mm
    return spec.particles.count * grain_volume(spec) / PACKING / drum


def check(spec: "RunSpec") -> None:
    """Grains must lie at random between wall and ends, in one layer at least, and leave room to
    flow. Raises SpecError."""
    g, largest = spec.geometry, longest_mm(spec)
    refuse_narrow("drum_diameter_mm", spec, LEAST_DIAMETER)
    refuse_narrow("drum_width_mm", spec, LEAST_WIDTH)
    layer = g.drum_diameter_mm * g.drum_width_mm / (2.0 * largest**2)
    if spec.particles.count < layer:
        few = f"at least {math.ceil(layer)}: less than one layer of grains would lie in the drum"
        raise SpecError("particles.count", spec.particles.count, few)
    if _filling(spec) > 0.7:
        most = int(0.7 / _filling(spec) * spec.particles.count)
        allowed = f"at most {most}: the drum would be more than 70 % full"
        raise SpecError("particles.count", spec.particles.count, allowed)


def advice(spec: "RunSpec") -> list[str]:
    """A drum that throws its grains about or carries them round."""
    froude = _froude(spec)
    if froude < 0.1:
        return []
    return [
        f"geometry.rotation_rate_deg_s gives a Froude number of {froude:.2g}; from 0.1 on grains "
        "are thrown and the surface has no angle"
    ]


def _froude(spec):
    rate = math.radians(spec.geometry.rotation_rate_deg_s)
    return rate**2 * 0.5e-3 * spec.geometry.drum_diameter_mm / GRAVITY


class _Drum:
    """A smooth drum, or a mesh; `clear` is the radius of the cylinder that nothing reaches into
    [m]."""

    def __init__(self, spec):
        g = spec.geometry
        self.radius, self.width = 0.5e-3 * g.drum_diameter_mm, 1e-3 * g.drum_width_mm
        mesh, middle = read_mesh(spec, "shell_stl"), 0.5 * self.width
        self.clear, self.mesh = self.radius, mesh
        if mesh is None:
            return
        widest = float(mesh.around(middle)[0].max())
        mesh.agree("its widest inside", 2.0 * widest, "drum_diameter_mm")
        self.clear = mesh.narrowest(0.0, self.width)
        if self.clear < LEAST_CLEAR * self.radius:
            least = f"{1e3 * LEAST_CLEAR * self.radius:.4g} mm at the least"
            found = f"reaches to {1e3 * self.clear:.4g} mm from the axis"
            mesh.refuse(f"{found}; allowed: {least}, or grains cannot flow")
        ends = mesh.heights(circle(0.95 * self.clear))
        for what, side, wanted in (("low", -1.0, 0.0), ("high", 1.0, self.width)):
            beyond = np.where(side * (ends - middle) > 0.0, side * ends, np.inf).min(axis=1)
            if not np.isfinite(beyond).all():
                mesh.refuse(f"has no end plate on its {what} side along z")
            mesh.in_place(f"its end plate on the {what} side", side * beyond, wanted)

    def walls(self) -> "WallSet":
        """The body that turns."""
        walls = builder.WallSet().body(SHELL, material=setup.WALL)
        if self.mesh:
            return walls.mesh(*self.mesh.body)
        walls.cylinder(self.radius, 0.0, self.width)
        return walls.disc(self.radius, 0.0).disc(self.radius, self.width)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, turn, and read the surface."""
    g, rng = spec.geometry, np.random.default_rng(spec.seed)
    drum, reach = _Drum(spec), largest_reach(spec)
    radius, rate = drum.radius, math.radians(g.rotation_rate_deg_s)
    sim = setup.build_simulation(spec, drum.walls(), gravity=(0.0, -GRAVITY, 0.0))
    radii = draw_radii(spec, spec.particles.count, rng)
    _fill(sim, spec, radii, drum.clear, drum.width, reach, rng)
    phases.rest(sim, spec, spec.numerics.max_time_s, "filling")
    sim.move_wall(SHELL, spin=(0.0, 0.0, rate))
    turn = 2.0 * math.pi / rate
    _turn(sim, spec, g.start_turns * turn, context, 0.0, 0.5)
    looks = []
    for k in range(LOOKS):
        _turn(sim, spec, g.turns * turn / LOOKS, context, 0.5 + 0.5 * k / LOOKS, 0.5 / LOOKS)
        looks.append(_look(sim, radius, 2.0 * mean_radius(spec), rate))
    context.finish(sim)
    surface, centre, passive = np.array(looks).T
    if not np.isfinite(surface).any():
        raise MeasureError("the bed has no surface: too few grains, or too fast a drum")
    return {
        "dynamic_angle_deg": float(np.nanmean(surface)),
        "dynamic_angle_sd_deg": float(np.nanstd(surface)),
        "centre_angle_deg": float(centre.mean()),
        "passive_rotation_ratio": float(np.nanmean(passive)),
        "froude_number": _froude(spec),
        "filling": _filling(spec),
    }


def _fill(sim, spec, radii, radius, width, reach, rng):
    """Layers of grains in the lower part of the drum, made where its inside is wide enough."""
    made, height = 0, -radius + 1.1 * reach
    while made < len(radii):
        half = math.sqrt(max(radius**2 - (abs(height) + reach) ** 2, 0.0))
        if half < 3.0 * reach:
            if height > 0.0:
                reason = "the grains do not fit into the drum in layers; fewer of them do"
                raise MeasureError(reason)
            height += 0.5 * reach
            continue
        sites = bed.sites_in_rectangle((-half, 0.0), (half, width), reach, rng)
        now = radii[made : made + len(sites)]
        bed.fill(sim, spec, now, sites, height - 1.1 * reach, reach, rng, order=(0, 2, 1))
        made, height = made + len(now), height + bed.PITCH * reach


def _turn(sim, spec, duration, context, begin, share):
    """Advance, with progress from `begin` over `share` and frames."""
    parts = max(round(duration / (2.0 * phases.look(spec))), 1)
    for k in range(parts):
        bed.advance_for(sim, duration / parts)
        context.progress(begin + share * (k + 1) / parts, f"{sim.time:.2f} s")
        context.frame(sim)


def _look(sim, radius, diameter, rate):
    """Slope of the surface [deg], angle of the centre of mass from the vertical [deg], and the spin
    of the passive bed over the drum's."""
    position, velocity, mass = sim.position, sim.velocity, sim.mass
    x, y = position[:, 0], position[:, 1]
    along, top = bed.surface_profile(x, y, sim.radius, -CHORD * radius, CHORD * radius, STRIPS)
    total = float(mass.sum())
    centre = float((mass * x).sum()) / total, float((mass * y).sum()) / total
    out = np.hypot(x, y)
    # below the axis and near the drum: what lies there is carried
    passive = (out > radius - PASSIVE * diameter) & (out < radius - 0.75 * diameter)
    passive &= x * centre[0] + y * centre[1] > 0.9 * out * math.hypot(*centre)
    speed = (x * velocity[:, 1] - y * velocity[:, 0])[passive]
    cubes = (out[passive] ** 3).sum()
    carried = (speed * out[passive]).sum() / cubes if passive.any() else math.nan
    hangs = math.degrees(math.atan2(centre[0], -centre[1]))
    return bed.profile_angle(along, top), hangs, float(carried) / rate


EXPERIMENT = Experiment(
    name="drum",
    title="Rotating drum",
    geometry=DrumGeometry,
    run=run,
    metrics=(
        Metric("dynamic_angle_deg", "mean slope of the moving surface", -90.0, 90.0),
        Metric("dynamic_angle_sd_deg", "its scatter over time", 0.0, target=False),
        Metric("centre_angle_deg", "angle of the centre of mass from the vertical", -180.0, 180.0),
        Metric("passive_rotation_ratio", "spin of the carried bed over the drum's", target=False),
        Metric("froude_number", "w^2 R / g", 0.0, target=False),
        Metric("filling", "share of the drum that the bed takes", 0.0, 1.0, target=False),
    ),
    defaults={"particles": {"count": 1800}, "numerics": {"max_time_s": 1.0}},
    check=check,
    prepare=_Drum,  # an unusable mesh is refused here
    advice=advice,
    poured=True,
    quantity=Quantity("dynamic_angle", "deg", 0.1, 89.0, "dynamic angle", relative=False),
    levers=lever("rotation_rate_deg_s", 1e-2, 1e4, "speed of rotation", needed=True),
    mechanisms=("cohesion", "rolling_law"),
)
