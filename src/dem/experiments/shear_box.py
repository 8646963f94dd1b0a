"""Direct shear: a split box of grains is compacted, pre-sheared and sheared under a normal load.

The lower half of the box moves; the upper half stands still and its side walls carry the shear force, divided by the
area of the box. A lid, free to move up and down, carries the normal load. As on the bench, the sample is compacted
and sheared to steady state under the pre-shear load, unloaded, then sheared under the test load, whose peak is the
point of the yield locus.
"""

import math

import numpy as np

from dem.experiments.setup import WALL, build_simulation, draw_radii, largest_radius, rest_energy
from dem.walls.builder import WallSet

GRAVITY = 9.81
FLANGE = 3.0  # width of the ledges outside the gap, in box lengths: no grain may fall out beside the moving half


def run(spec, context):
    """Shear at one normal stress; returns the metrics of docs/architecture.md."""
    g = spec.geometry
    rng = np.random.default_rng(spec.seed)
    box = _Box(spec, rng)
    sim = box.sim
    context.progress(0.05, "filling")
    box.settle()
    preshear = g.preshear_normal_stress_kPa or g.normal_stress_kPa
    box.load(preshear)
    box.compact()
    density = box.bulk_density()
    context.progress(0.3, "pre-shear")
    steady = box.shear(1e-3 * g.preshear_displacement_mm)
    box.shear(-1e-3 * g.preshear_displacement_mm)
    box.load(g.normal_stress_kPa)
    box.compact()
    context.progress(0.6, "shear")
    curve = box.shear(1e-3 * g.shear_displacement_mm)
    context.finish(sim)
    smooth = _running_mean(curve, max(len(curve) // 20, 1))
    late = curve[len(curve) // 2 :]
    return {
        "shear_stress_kPa": float(smooth.max()),
        "steady_shear_stress_kPa": float(late.mean()),
        "steady_shear_stress_sd_kPa": float(late.std(ddof=1)),
        "preshear_stress_kPa": float(steady[len(steady) // 2 :].mean()),
        "normal_stress_kPa": box.normal_stress(),
        "bulk_density_kg_m3": density,
        "particles": int(sim.n),
    }


def _running_mean(values, width):
    return np.convolve(values, np.ones(width) / width, mode="valid")


class _Box:
    """The split box: lower half, upper half and lid are three bodies."""

    def __init__(self, spec, rng):
        g = spec.geometry
        self.spec, self.g = spec, g
        self.length, self.width = 1e-3 * g.box_length_mm, 1e-3 * g.box_width_mm
        self.area = self.length * self.width
        self.half_height = 0.5e-3 * g.box_height_mm
        self.speed = 1e-3 * g.shear_speed_mm_s
        radii = draw_radii(spec, spec.particles.count, rng)
        largest = largest_radius(spec)
        top = self._fill_height(largest, len(radii))
        self.sim = build_simulation(spec, self._walls(top))
        self._fill(radii, largest, rng)
        self._thickness = None

    def _fill_height(self, r, count):
        columns = max(int(self.length / (2.1 * r)), 1) * max(int(self.width / (2.1 * r)), 1)
        return -self.half_height + 2.1 * r * (count // columns + 2)

    def _walls(self, top):
        a, b, h = 0.5 * self.length, 0.5 * self.width, self.half_height
        tall = max(2.0 * top, h)
        walls = WallSet().body("lower", material=WALL)
        walls.rectangle((0, 0, -h), (a, 0, 0), (0, b, 0))
        for side in (-1.0, 1.0):
            walls.rectangle((side * a, 0, -0.5 * h), (0, b, 0), (0, 0, 0.5 * h))
            # ledge in the shear plane, which the upper half's wall passes over
            walls.rectangle((side * a * (1 + FLANGE), 0, 0), (a * FLANGE, 0, 0), (0, b, 0))
        walls.body("upper", material=WALL)
        for side in (-1.0, 1.0):
            walls.rectangle((side * a, 0, 0.5 * tall), (0, b, 0), (0, 0, 0.5 * tall))
            walls.rectangle((side * a * (1 + FLANGE), 0, 0), (a * FLANGE, 0, 0), (0, b, 0))
        walls.body("sides", material=WALL)
        for side in (-1.0, 1.0):
            normal = (0.0, -side, 0.0)
            walls.plane((0, side * b, 0), normal)
        walls.body(
            "lid",
            material=WALL,
            origin=(0, 0, top),
            free={"mass": self._lid_mass(), "axis": (0, 0, 1), "load": 0.0, "drag": 0.0},
        )
        return walls.rectangle((0, 0, 0), (a, 0, 0), (0, b, 0))

    def _lid_mass(self):
        """A lid as heavy as the grains moves with them and follows the load quickly."""
        m = self.spec.materials.particle
        radius = largest_radius(self.spec)
        return self.spec.particles.count * 4.0 / 3.0 * math.pi * radius**3 * m.density_kg_m3

    def _fill(self, radii, r, rng):
        a, b = 0.5 * self.length - 1.05 * r, 0.5 * self.width - 1.05 * r
        nx, ny = int(2 * a / (2.1 * r)) + 1, int(2 * b / (2.1 * r)) + 1
        x = np.linspace(-a, a, nx) if nx > 1 else np.zeros(1)
        y = np.linspace(-b, b, ny) if ny > 1 else np.zeros(1)
        layer = np.array([(u, v) for v in y for u in x])
        count = len(radii)
        site = np.tile(layer, (count // len(layer) + 1, 1))[:count]
        z = -self.half_height + 1.1 * r + 2.1 * r * (np.arange(count) // len(layer))
        shift = rng.uniform(-0.04 * r, 0.04 * r, (count, 3))
        self.sim.add_particles(np.column_stack([site, z]) + shift, radii)
        lid = self.sim.walls.index("lid")
        self.sim.wall_state.origin[lid, 2] = z.max() + 1.2 * r
        mass = float(self.sim.mass.sum())
        self.sim.wall_state.mass[lid] = mass
        # critical damping of the lid on a bed of this stiffness would do; this much is safe at any load
        self.sim.wall_state.drag[lid] = mass * 20.0 * math.sqrt(GRAVITY / self.half_height)

    def load(self, stress_kPa):
        """Set the normal stress at the shear plane: the load on the lid beside the weight of lid and upper grains."""
        lid = self.sim.walls.index("lid")
        above = self.sim.position[:, 2] > 0.0
        weight = (float(self.sim.mass[above].sum()) + self.sim.wall_state.mass[lid]) * GRAVITY
        self.sim.move_wall("lid", load=-(1e3 * stress_kPa * self.area - weight))
        self.target = stress_kPa

    def settle(self):
        self._until_rest(1e-3, 0.3)

    def compact(self):
        """Wait until the grains are at rest under the lid's load."""
        self._until_rest(1e-4, 0.3)

    def _until_rest(self, threshold, limit):
        sim = self.sim
        start = sim.time
        while sim.time - start < limit:
            sim.advance(round(5e-3 / sim.time_step))
            if sim.time - start > 0.02 and rest_energy(sim) < threshold:
                break

    def shear(self, displacement):
        """Move the lower half; returns the shear stress [kPa] along the way, each value a mean over a short stretch."""
        sim = self.sim
        direction = math.copysign(1.0, displacement)
        sim.move_wall("lower", velocity=(direction * self.speed, 0.0, 0.0))
        stretches = 40
        steps = max(round(abs(displacement) / self.speed / sim.time_step / stretches), 1)
        stress, normal = [], []
        for _ in range(stretches):
            before, press = sim.wall_impulse("upper"), sim.wall_impulse("lid")
            sim.advance(steps)
            span = steps * sim.time_step
            drag = (sim.wall_impulse("upper") - before)[0] / span
            stress.append(direction * drag / self.area * 1e-3)
            normal.append((sim.wall_impulse("lid") - press)[2] / span / self.area * 1e-3)
        sim.move_wall("lower", velocity=(0.0, 0.0, 0.0))
        self._pressure = float(np.mean(normal))
        return np.array(stress)

    def normal_stress(self):
        """Mean normal stress at the shear plane over the last shear [kPa]: lid pressure and weight of the upper
        grains."""
        above = self.sim.position[:, 2] > 0.0
        weight = float(self.sim.mass[above].sum()) * GRAVITY
        return self._pressure + 1e-3 * weight / self.area

    def bulk_density(self):
        """Mass of grains over the volume under the lid [kg/m3]."""
        height = self.sim.wall_origin("lid")[2] + self.half_height
        return float(self.sim.mass.sum()) / (height * self.area)
