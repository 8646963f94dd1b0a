"""Wall friction after Jenike: grains in a ring, pressed by a lid, rest on a plate that slides away
under them.

The ring holds them back; the plate feels their weight and the lid's load, and friction. Friction
over normal force on the plate is the wall friction, whatever the ring carries (Schulze 2008,
Powders and Bulk Solids, section 4.3; ASTM D6128).
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.constants import GRAVITY
from dem.experiments import bed, builder, phases, setup
from dem.experiments.declare import LOAD, Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.experiments.mesh import outside, read_mesh
from dem.grains.sizes import largest_reach, longest_mm, smallest_radius
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec

LEAST_WIDTH = 5.0  # of the largest grain
STRETCHES = 20  # the path is cut into so many means
RAMP = 10  # changes of the load until it is full
REST = 60.0  # looks that the loaded grains get to rest, at most
GAP = 0.02  # of a grain's radius, between ring and plate


class WallFrictionGeometry(Part):
    """Ring, lid and plate."""

    ring_diameter_mm: float = field(24.0, "inner diameter of the ring", gt=0)
    normal_stress_kPa: float = field(2.0, "load of the lid over the ring's area", gt=0)
    slide_speed_mm_s: float = field(20.0, "speed of the plate", gt=0)
    slide_mm: float = field(4.0, "path of the plate; its second half is read", gt=0)
    plate_stl: str | None = mesh_field(
        "mesh [mm] of a profiled plate in place of the smooth one, which slides along x: its "
        "highest points at z = 0, and under all of the ring to the end of the path"
    )


def check(spec: "RunSpec") -> None:
    """The ring must hold grains side by side, and the bed must reach the lid with two layers at
    least."""
    g, largest = spec.geometry, longest_mm(spec)
    refuse_narrow("ring_diameter_mm", spec, LEAST_WIDTH)
    layers = spec.particles.count * largest**2 / g.ring_diameter_mm**2
    if layers < 2.0:
        most = largest * math.sqrt(0.5 * spec.particles.count)
        allowed = f"at most {most:.3g}: two layers of grains, or more grains"
        refuse("ring_diameter_mm", spec, allowed)


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill, load, slide; returns the metrics."""
    g, rng = spec.geometry, np.random.default_rng(spec.seed)
    radius, reach = 0.5e-3 * g.ring_diameter_mm, largest_reach(spec)
    area = math.pi * radius**2

    def walls(top):
        mesh, walls = _plate(spec), builder.WallSet().body("plate", material=setup.WALL)
        walls.mesh(*mesh.body) if mesh else walls.plane((0, 0, 0), (0, 0, 1))
        walls.body("ring", material=setup.WALL).cylinder(radius, GAP * reach, 2.0 * top)
        free = {"mass": 0.0, "axis": (0, 0, 1), "load": 0.0}  # it hangs until it is lowered
        walls.body("lid", material=setup.WALL, origin=(0.0, 0.0, top), free=free)
        return walls.disc(radius)

    sim = bed.poured(spec, walls, radius, 0.0, rng)
    context.progress(0.3, "filled")
    # lower the lid onto the grains and load it, its own weight counted
    weight = bed.lay_lid(sim, spec, float((sim.position[:, 2] + sim.radius).max())) * GRAVITY
    for part in np.linspace(0.0, 1.0, RAMP + 1)[1:]:
        sim.move_wall("lid", load=weight - part * (1e3 * g.normal_stress_kPa * area))
        bed.advance_for(sim, 0.4 * phases.look(spec))
    phases.rest(sim, spec, REST * phases.look(spec), "loading")
    context.progress(0.5, "loaded")
    speed = 1e-3 * g.slide_speed_mm_s
    sim.move_wall("plate", velocity=(speed, 0.0, 0.0))
    duration = 1e-3 * g.slide_mm / speed / STRETCHES
    forces = np.array([bed.force_on(sim, "plate", duration) for _ in range(STRETCHES)])
    friction, normal = -forces[:, 0], -forces[:, 2]
    context.finish(sim)
    late = slice(STRETCHES // 2, None)
    shear, press = float(friction[late].mean()), float(normal[late].mean())
    ratio = friction[late] / normal[late]
    return {
        "wall_friction_angle_deg": math.degrees(math.atan2(shear, press)),
        "wall_friction": shear / press,
        "wall_friction_sd": float(ratio.std(ddof=1)),
        "wall_shear_stress_kPa": 1e-3 * shear / area,
        "wall_normal_stress_kPa": 1e-3 * press / area,
    }


def _plate(spec):
    """`Mesh` of the plate; None for a smooth one."""
    ring, path = 0.5e-3 * spec.geometry.ring_diameter_mm, 1e-3 * spec.geometry.slide_mm
    low, high = np.array([-ring - path, -ring]), np.array([ring, ring])
    mesh = read_mesh(spec, "plate_stl", outside(low, high))
    if mesh is None:
        return None
    surface = mesh.topped(low, high, "under the ring and along its path its surface")
    if surface.min() < -smallest_radius(spec):
        allowed = f"the smallest grain's radius, {1e3 * smallest_radius(spec):.4g} mm"
        found = f"is {-1e3 * surface.min():.4g} mm deep"
        mesh.refuse(f"{found}; allowed: {allowed}, or grains leave under the ring")
    return mesh


EXPERIMENT = Experiment(
    name="wall_friction",
    title="Wall friction",
    geometry=WallFrictionGeometry,
    run=run,
    metrics=(
        Metric("wall_friction_angle_deg", "arc tangent of the wall friction", 0.0, 90.0),
        Metric("wall_friction", "friction over normal force on the plate", 0.0),
        Metric("wall_friction_sd", "its scatter along the path", 0.0, target=False),
        Metric("wall_shear_stress_kPa", "friction over the ring's area", 0.0),
        Metric("wall_normal_stress_kPa", "normal force over the ring's area", 0.0, target=False),
    ),
    defaults={
        "particles": {"count": 800},
        "numerics": {"max_time_s": 2.0, "rayleigh_fraction": 0.2},
    },
    check=check,
    prepare=_plate,  # an unusable mesh is refused here
    poured=True,
    quantity=Quantity(
        "wall_shear_stress", "kPa", 1e-4, 1e4, "wall shear stress", relative=True, scale=LOAD
    ),
    levers=lever("normal_stress_kPa", 1e-3, 1e4, "normal stress", needed=True),
    mechanisms=("wall_adhesion", "stress_dependent_friction"),
)
