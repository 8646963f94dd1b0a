"""The cases that both engines run, and the quantities that are read from either's final state by
the same code."""

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.speed import cases as benchmark
from dem.contact.registry import ContactParameters, Laws
from dem.experiments import heap
from dem.measure.heap import measure_heap
from dem.spec import parse_spec
from scenes import SALT, floor, make

from . import peer

RESTITUTION, FRICTION, ROLLING = 0.544, 0.5, 0.23
OPTIMUM = {"restitution": RESTITUTION, "static_friction": 0.85}
STEEL = {"restitution": 0.421, "static_friction": 0.71, "rolling_friction": 0.368}
"""The paper's optimum, but for the rolling friction between grains."""
PITCH = 8e-3  # between pairs, out of each other's reach [m]
ROW = 8
PAIRS, SINGLES = 40, 20

CONTACTS = {
    "no rolling resistance": ("constant_torque_relative", FRICTION, 0.0),
    "relative": ("constant_torque_relative", FRICTION, ROLLING),
    "elastic-plastic": ("elastic_plastic", FRICTION, ROLLING),
}
"""Name -> rolling law, sliding and rolling friction of contacts whose forces are compared at one
instant."""
OVERLAP = 0.01  # of R*
IMPACTS = {
    "sliding friction alone": ("constant_torque_relative", FRICTION, 0.0),
    "rolling alone, relative": ("constant_torque_relative", 0.0, ROLLING),
    "rolling alone, elastic-plastic": ("elastic_plastic", 0.0, ROLLING),
}
"""The same for impacts that are followed from touch to parting."""
IMPACT_SPEED = 0.3  # [m/s]
IMPACT_STEP, IMPACT_STEPS = 1e-6, 600  # [s]; the longest impact takes some 200 steps

BED = {"n": 3000, "steps": 30000}

SEEDS = (1, 2, 3, 4)
PRIMES = (86028121, 15485917, 32452883, 49979687)
MORE_PRIMES = (67867967, 104395301)
"""LIGGGHTS' seeds: primes above 10000; more of the elastic-plastic case."""
HEAP_TIME = 2.0  # both engines' heaps are read at this time [s]
HEAPS = {
    "relative, 0.46": ("constant_torque_relative", 0.46),
    "elastic-plastic, 0.46": ("elastic_plastic", 0.46),
}
"""Name -> rolling law and rolling friction between grains: for equal grains the torque of our
default law at 0.23."""
HEAP_SEEDS = {"relative, 0.46": SEEDS, "elastic-plastic, 0.46": tuple(range(1, 9))}
"""Our seeds of each case. The radial angle of an elastic-plastic heap scatters by 1.2 to 2 degrees:
four of them tell neither its mean to a degree nor that scatter."""


def contact_parameters(rolling=ROLLING, friction=FRICTION):
    """Grain on grain and on the floor; the elastic-plastic spring is that of LIGGGHTS."""
    return ContactParameters(
        RESTITUTION,
        friction,
        rolling,
        rolling_stiffness=peer.STIFFNESS_FACTOR,
        rolling_damping=peer.DAMPING_RATIO,
    )


def unit(rng, n):
    """(n, 3) random directions."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def sites(n):
    """(n, 3) places [m], PITCH apart and above the floor, and the width of the box."""
    k = np.arange(n)
    place = np.column_stack([k % ROW, k // ROW % ROW, k // ROW**2]) + [0.5, 0.5, 1.0]
    return place * PITCH, ROW * PITCH


def pairs(law, contact, gap, speed, spin, dt, seed=7):
    """PAIRS of grains of 1 to 3 mm, and SINGLES over the floor, moving at random; returns the
    simulation and the width.

    gap: between the surfaces over R*, negative for an overlap; speed: each pair's (normal,
    tangential) relative velocity [m/s], approaching; spin: largest of each grain's three [rad/s].
    The firsts of the pairs come first, then the singles, then the seconds.
    """
    rng = np.random.default_rng(seed)
    place, width = sites(PAIRS + SINGLES)
    n = unit(rng, PAIRS + SINGLES)
    n[PAIRS:] = (0.0, 0.0, -1.0)
    radius = rng.uniform(0.5e-3, 1.5e-3, (2, PAIRS + SINGLES)).astype(np.float32).astype(float)
    r_eff = radius[0] * radius[1] / radius.sum(axis=0)
    second = place + n * (radius.sum(axis=0) + gap * r_eff)[:, None]
    place[PAIRS:, 2] = radius[0, PAIRS:] * (1.0 + gap)
    slide = np.cross(n, unit(rng, len(n)))
    slide /= np.linalg.norm(slide, axis=1, keepdims=True)
    velocity = speed[0] * n + speed[1] * slide
    w = rng.uniform(-spin, spin, (2, len(n), 3))
    sim = make(contact, laws=Laws(rolling=law), wall=SALT, walls=floor(), dt=dt, precision="double")
    sim.add_particles(place, radius[0], velocity=velocity, spin=w[0])
    sim.add_particles(second[:PAIRS], radius[1, :PAIRS], spin=w[1, :PAIRS])
    return sim, width


def contacts(name):
    """Overlapping pairs of the case in CONTACTS: simulation, width [m], rolling law and contact
    parameters."""
    law, friction, rolling = CONTACTS[name]
    parameters = contact_parameters(rolling, friction)
    # so short a step that a spring that starts from nothing adds nothing
    return *pairs(law, parameters, -OVERLAP, (0.05, 0.05), 20.0, 1e-10), law, parameters


def impacts(name):
    """Pairs about to touch of the case in IMPACTS: simulation, width [m], rolling law and contact
    parameters."""
    law, friction, rolling = IMPACTS[name]
    parameters = contact_parameters(rolling, friction)
    speed = (IMPACT_SPEED, 0.5 * IMPACT_SPEED)
    return *pairs(law, parameters, 1e-3, speed, 100.0, IMPACT_STEP), law, parameters


def bed(seed, n, steps):
    """The benchmark's bed of grains that have yet to settle, from a lattice shaken by `seed`."""
    width = benchmark.box_width(n)
    start = benchmark.lattice(n, seed), width
    return benchmark.bed(n, rolling="constant_torque_relative", start=start), width


def heap_spec(law, rolling, seed, count=2500, diameter_mm=3.1748):
    """The paper's optimum with coarse grains, as the quick profile has them, under another rolling
    law."""
    extra = {}
    if law == "elastic_plastic":
        extra = {
            "rolling_stiffness_factor": peer.STIFFNESS_FACTOR,
            "rolling_damping_ratio": peer.DAMPING_RATIO,
        }
    return parse_spec(
        {
            "experiment": "heap",
            "seed": seed,
            "materials": {"particle": {"density_kg_m3": SALT.density}},
            "contacts": {
                "particle_particle": OPTIMUM | {"rolling_friction": rolling},
                "particle_wall": STEEL,
            },
            "laws": {"rolling": law},
            "law_parameters": extra,
            "particles": {"count": count, "diameter_mm": diameter_mm},
            "geometry": {"generation_rate_per_s": count},
            "numerics": {"max_time_s": HEAP_TIME},
        }
    )


def radius_of(spec):
    """Radius of the grains of a heap [m], as the engine holds it."""
    return float(np.float32(0.5e-3 * spec.particles.diameter_mm))


class Quiet:
    """A run's surroundings that keep nothing."""

    progress = frame = checkpoint = staticmethod(lambda *_: None)
    resume = staticmethod(lambda: None)


def our_heap(spec):
    """Final state of the heap in this engine, see `state_of_sim`."""
    return state_of_sim(heap.pour(spec, Quiet)[0])


def state_of_sim(sim):
    """Position, velocity, spin (n, 3) and radius (n,) of all grains; SI units."""
    return sim.position, sim.velocity, sim.spin, sim.radius


def state_of(dump):
    """The same from a dump of LIGGGHTS."""
    return (*peer.vectors(dump, "", "v", "omega"), dump["radius"])


def rest_ratio(velocity, spin, radius, gravity=9.81):
    """Kinetic energy of motion and of spin, each over the energy that lifts every grain by its
    radius [-]."""
    lift = gravity * (radius**4).sum()
    motion = 0.5 * (radius**3 * (velocity**2).sum(axis=1)).sum()
    turning = 0.2 * (radius**5 * (spin**2).sum(axis=1)).sum()
    return float(motion / lift), float(turning / lift)


def coordination(position, radius):
    """Mean number of other grains that a grain touches."""
    near = cKDTree(position).query_pairs(2.0 * radius.max(), output_type="ndarray")
    gap = np.linalg.norm(position[near[:, 0]] - position[near[:, 1]], axis=1)
    return 2.0 * float((gap < radius[near].sum(axis=1)).mean()) * len(near) / len(radius)


def packing(position, radius, width, low, high):
    """Solid fraction between the heights low and high [m] of a box: the spheres' share, cut by both
    planes."""

    def below(z):
        cap = np.clip(z - position[:, 2] + radius, 0.0, 2.0 * radius)
        return float((np.pi * cap**2 * (radius - cap / 3.0)).sum())

    return (below(high) - below(low)) / (width**2 * (high - low))


def measure_bed(state, width):
    """Metrics of a bed: grains in its middle half tell the packing, all of them the rest."""
    position, velocity, spin, radius = state
    height = 2.0 * float(position[:, 2].mean())
    motion, turning = rest_ratio(velocity, spin, radius)
    return {
        "height_mm": 1e3 * height,
        "packing_fraction": packing(position, radius, width, 0.25 * height, 0.75 * height),
        "coordination": coordination(position, radius),
        "motion_energy_ratio": motion,
        "spin_energy_ratio": turning,
    }


def measure_pile(state, spec):
    """Metrics of a heap by `dem.measure.heap`, with coordination and rest of the grains on the
    plate."""
    position, velocity, spin, radius = state
    rig = heap.Rig(spec.geometry)
    on_plate = (position[:, 2] > 0.0) & (position[:, 2] < 0.5 * rig.orifice_height)
    on_plate &= np.hypot(position[:, 0], position[:, 1]) < rig.plate_radius
    metrics = measure_heap(position, radius, velocity, rig.plate_radius)
    motion, turning = rest_ratio(velocity[on_plate], spin[on_plate], radius[on_plate])
    keep = ("angle_of_repose_deg", "radial_angle_deg", "height_mm", "on_plate")
    return {k: metrics[k] for k in keep} | {
        "in_funnel": int((position[:, 2] > rig.orifice_height - 2e-3).sum()),
        "coordination": coordination(position[on_plate], radius[on_plate]),
        "motion_energy_ratio": motion,
        "spin_energy_ratio": turning,
    }
