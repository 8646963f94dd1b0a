"""The draw-down box: grains run out of an upper box through a slot in its floor and heap in a lower
one.

One test gives four numbers: the slope that stays above (shear angle), the slope of the heap below,
the mass flow and the share that ran out (Roessler, Richter, Katterfeld and Will 2019, Powder
Technology 343:803). Both boxes are read along x; front and back plates bound them.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dem.experiments import bed, builder, outflow, phases, setup
from dem.experiments.declare import Experiment, Metric, Quantity, lever, refuse, refuse_narrow
from dem.experiments.mesh import at_rims, read_mesh, rectangle
from dem.flow import FREE_FLOW_RATIO, LOOSE
from dem.grains.sizes import grain_volume, longest_mm, mean_radius, smallest_radius
from dem.schema import Part, field, mesh_field

if TYPE_CHECKING:
    from dem.run import RunContext
    from dem.spec import RunSpec
    from dem.walls.builder import WallSet

LEAST_DEPTH = 3.0  # of the largest grain
STRIPS = 10  # of each flank


class DrawDownGeometry(Part):
    """Upper box over lower box, of equal depth between a front and a back plate."""

    upper_width_mm: float = field(60.0, "inner width of the upper box", gt=0)
    lower_width_mm: float = field(90.0, "inner width of the lower box", gt=0)
    depth_mm: float = field(12.0, "inner distance of front and back plate", gt=0)
    slot_width_mm: float = field(16.0, "slot across the middle of the upper floor", gt=0)
    fall_height_mm: float = field(60.0, "upper floor above the lower one", gt=0)
    boxes_stl: str | None = mesh_field(
        "mesh [mm] of both boxes in one, without the gate, in place of the keys' walls: inside it "
        "is as the keys say, the slot about x = 0, the lower floor at z = 0, and open above"
    )


def check(spec: "RunSpec") -> None:
    """Grains must pass slot and plates, slopes must stay above, and the heap must fit below."""
    g, largest = spec.geometry, longest_mm(spec)
    refuse_narrow("slot_width_mm", spec, FREE_FLOW_RATIO, "arches stop a narrower flow")
    refuse_narrow("depth_mm", spec, LEAST_DEPTH)
    least = g.slot_width_mm + 10.0 * largest
    for key in ("upper_width_mm", "lower_width_mm"):
        if getattr(g, key) < least:
            allowed = f"at least {least:g}: the slot and five of the largest grain on either side"
            refuse(key, spec, allowed)
    area = 1e-6 * g.upper_width_mm * g.depth_mm
    deep = 1e3 * spec.particles.count * grain_volume(spec) / (LOOSE * area)
    if deep < g.slot_width_mm:
        narrow = g.upper_width_mm * deep / g.slot_width_mm
        allowed = f"at most {narrow:.3g}: the grains would lie only {deep:.3g} mm deep, less than "
        refuse("upper_width_mm", spec, f"{allowed}the slot is wide; or more grains")
    volume = 1e9 * spec.particles.count * grain_volume(spec) / LOOSE
    if volume > g.lower_width_mm * g.depth_mm * g.fall_height_mm:
        least = volume / (g.lower_width_mm * g.depth_mm)
        allowed = f"at least {least:.3g}: the grains would fill the lower box up to the upper floor"
        refuse("fall_height_mm", spec, allowed)


class _Boxes:
    """Dimensions in SI: x across, y from front to back, z = 0 the lower floor."""

    def __init__(self, spec):
        g = spec.geometry
        self.upper, self.lower = 0.5e-3 * g.upper_width_mm, 0.5e-3 * g.lower_width_mm
        self.deep, self.slot = 0.5e-3 * g.depth_mm, 0.5e-3 * g.slot_width_mm
        self.floor = 1e-3 * g.fall_height_mm
        mesh = self.mesh = read_mesh(spec, "boxes_stl", at_rims())
        if mesh is None:
            return
        # its floors, slot and sides must be where the keys have them
        gap = smallest_radius(spec)
        volume = 4.0 * self.upper * self.deep * (mesh.high - self.floor)
        if LOOSE * volume < spec.particles.count * grain_volume(spec):
            mesh.refuse("is too low: loosely poured, the grains reach above its rim")
        middle = 0.5 * (self.floor + mesh.high)
        mesh.four_sided("the upper box", middle, self.upper, self.deep)
        mesh.four_sided("the lower box", 0.5 * self.floor, self.lower, self.deep)
        y = self.deep - gap

        def over(*ends):
            return rectangle((min(ends), -y), (max(ends), y))

        through = mesh.covering(over(gap - self.slot, self.slot - gap), "below the slot")
        mesh.in_place("the first surface below the slot", through, 0.0)
        for side in (-1.0, 1.0):
            ledge = over(side * (self.slot + gap), side * (self.upper - gap))
            found = mesh.covering(ledge, "beside the slot its floor")
            mesh.in_place("the upper floor", found, self.floor)
        below = over(gap - self.lower, self.lower - gap)
        floor = mesh.covering(below, "its lower floor", below=0.5 * self.floor)
        mesh.in_place("the lower floor", floor, 0.0)

    def walls(self, top: float) -> "WallSet":
        """Two floors, four sides, front and back up to `top`, and the gate over the slot."""
        walls = builder.WallSet().body("boxes", material=setup.WALL)
        flat, up = np.array([0.0, self.deep, 0.0]), np.array([0.0, 0.0, 1.0])
        out = np.array([1.0, 0.0, 0.0])
        if self.mesh:
            walls.mesh(*self.mesh.body)
            # sides of the upper box above the mesh, within which grains are made
            half = 0.5 * (top - self.mesh.high)
            z = top - half
            for side in (-1.0, 1.0) if half > 0.0 else ():
                walls.rectangle((side * self.upper, 0.0, z), flat, half * up)
                walls.rectangle((0.0, side * self.deep, z), self.upper * out, half * up)
        else:
            high, ledge = 0.5 * (top - self.floor), 0.5 * (self.upper - self.slot)
            wide, low = max(self.upper, self.lower), 0.5 * self.floor
            walls.rectangle((0.0, 0.0, 0.0), self.lower * out, flat)
            for side in (-1.0, 1.0):
                middle = side * 0.5 * (self.slot + self.upper)
                walls.rectangle((middle, 0.0, self.floor), ledge * out, flat)
                walls.rectangle((side * self.upper, 0.0, self.floor + high), flat, high * up)
                walls.rectangle((side * self.lower, 0.0, low), flat, low * up)
                walls.rectangle((0.0, side * self.deep, 0.5 * top), wide * out, 0.5 * top * up)
        gate = walls.body("gate", material=setup.WALL)
        return gate.rectangle((0.0, 0.0, self.floor), (self.slot, 0.0, 0.0), (0.0, self.deep, 0.0))


def run(spec: "RunSpec", context: "RunContext") -> dict[str, Any]:
    """Fill the upper box, open the slot, and read both slopes when all rest."""
    boxes, rng = _Boxes(spec), np.random.default_rng(spec.seed)
    sim = bed.poured(spec, boxes.walls, (boxes.upper, boxes.deep), boxes.floor, rng)
    context.progress(0.3, "filled")
    total = float(sim.mass.sum())
    setup.take_away(sim, "gate")
    below, known = boxes.floor - 2.0 * mean_radius(spec), [0.0]

    def leave():
        now = float(sim.mass[sim.position[:, 2] < below].sum())
        gone, known[0] = now - known[0], now
        return gone

    times, masses = outflow.watch(sim, spec, leave, context, 0.6)
    ended, start, slopes = "", sim.time, phases.Slopes(spec)
    while not ended and sim.time - start < spec.numerics.max_time_s:
        bed.advance_for(sim, phases.look(spec))
        ended = slopes.ended(sim, lambda: _angles(sim, spec, boxes))
    if not ended:
        phases.refuse("drawing down", sim.time - start, phases.motion(sim), math.nan, phases.RESTS)
    context.finish(sim, ended)
    shear, repose = _angles(sim, spec, boxes)
    return {
        "shear_angle_deg": shear,
        "angle_of_repose_deg": repose,
        "mass_flow_g_s": 1e3 * outflow.steady_flow(times, masses),
        "discharged_share": float(masses[-1] / total),
        "emptying_time_s": outflow.ended(times, masses),
    }


def _angles(sim, spec, boxes):
    """Shear angle above and angle of repose below [deg]."""
    position, radius = sim.position, sim.radius
    above = position[:, 2] > boxes.floor
    edge = mean_radius(spec)
    stays = boxes.slot + edge, boxes.upper - edge
    heap = 2.0 * edge, boxes.lower - edge  # from a grain beside its crest to the wall
    shear = _flanks(position[above], radius[above], *stays, boxes.floor)
    return shear, -_flanks(position[~above], radius[~above], *heap, 0.0)


def _flanks(position, radius, low, high, floor):
    """Mean rise [deg] of the surface with the distance from the middle, left and right; 0 where
    nothing lies.

    Strips that hold no second layer are the foot and left out.
    """
    angles = []
    for side in (-1.0, 1.0):
        across, z = side * position[:, 0], position[:, 2]
        own = across > 0.0
        along, top = bed.surface_profile(across[own], z[own], radius[own], low, high, STRIPS)
        layers = floor + 3.0 * float(radius.mean()) if len(radius) else floor
        top = np.where(top > layers, top, np.nan)
        angles.append(bed.profile_angle(along, top))
    good = [a for a in angles if math.isfinite(a)]
    return float(np.mean(good)) if good else 0.0


EXPERIMENT = Experiment(
    name="draw_down",
    title="Draw-down box",
    geometry=DrawDownGeometry,
    run=run,
    metrics=(
        Metric("shear_angle_deg", "mean slope that stays in the upper box", -90.0, 90.0),
        Metric("angle_of_repose_deg", "mean slope of the heap in the lower box", -90.0, 90.0),
        Metric("mass_flow_g_s", "steady flow through the slot", 0.0),
        Metric("discharged_share", "of the mass", 0.0, 1.0 + 1e-9),
        Metric("emptying_time_s", "from the opening until the last grain leaves", 0.0),
    ),
    defaults={"particles": {"count": 4000}, "numerics": {"max_time_s": 10.0}},
    check=check,
    prepare=_Boxes,  # an unusable mesh is refused here
    poured=True,
    walls=lambda spec: _Boxes(spec).walls(2e-3 * spec.geometry.fall_height_mm),
    quantity=Quantity("angle_of_repose", "deg", 0.1, 89.0, "angle of repose", relative=False),
    levers=lever("slot_width_mm", 1.0, 1e4, "slot")
    | lever("fall_height_mm", 1.0, 1e4, "fall height"),
    mechanisms=("cohesion", "rolling_law", "size_bias"),
)
