"""LIGGGHTS as a peer: run one of the input decks beside this file and read the state that it
leaves."""

import shutil
from pathlib import Path

import numpy as np

from benchmarks.speed.peers import INPUTS, write_states
from calibration.engines.liggghts import INSTALL, launcher, version
from calibration.engines.mesh import disc, frustum, write_mesh
from calibration.engines.program import find, read_frames
from calibration.engines.program import run as start
from dem.constants import GRAVITY
from dem.experiments.heap import Rig
from dem.experiments.setup import time_step_of
from dem.materials import material_of

FOLDER = Path(__file__).parent
LONGEST_S = 36000.0
COLLAR = 0.75  # of the funnel above its rim, in radii of its mouth: grains are made at 0.25
ROLLING = {"constant_torque_relative": "cdt", "elastic_plastic": "epsd"}
"""Our name of a rolling law -> theirs."""

STIFFNESS_FACTOR = 1.5
"""LIGGGHTS takes k_r = 2.25 k (mu_r R*)^2 with the secant stiffness k = F/overlap, 2/3 of the
tangent S_n of ours."""
DAMPING_RATIO = 0.3 / np.sqrt(1.4 / 0.4)
"""Of the rolling springs in the recorded runs, about the contact point; 0.3 about the centre of a
grain."""


def run(deck, folder, variables):
    """Run `deck` in `folder`; returns the version and the dumped states, a list of {column: (n,)
    array}.

    Raises EngineError with the end of LIGGGHTS' own words when it fails.
    """
    flags = [word for k, v in variables.items() for word in ("-var", k, str(v))]
    command = [*launcher(), find("liggghts", INSTALL), "-in", str(FOLDER / deck), *flags]
    start(command, folder, LONGEST_S)
    return version(), read_frames(folder / "end.dump")


def vectors(state, *names):
    """(n, 3) array of each quantity named: 'v' takes the columns vx, vy, vz; '' takes x, y, z."""
    return [np.column_stack([state[name + axis] for axis in "xyz"]) for name in names]


def run_pairs(sim, width, folder, law, parameters, steps):
    """The grains of `sim` without gravity, over a floor at z = 0; see `pairs.in`."""
    write_states(sim, width, folder)
    material = next(iter(sim.materials.values()))
    return run(
        "pairs.in",
        folder,
        {
            "law": ROLLING[law],
            "tangential": "history" if parameters.static_friction > 0.0 else "off",
            "young": material.young_modulus,
            "poisson": material.poisson_ratio,
            "restitution": parameters.restitution,
            "friction": parameters.static_friction,
            "rolling": parameters.rolling_friction,
            "viscous": parameters.rolling_damping,
            "dt": sim.time_step,
            "steps": steps,
        },
    )


def run_bed(sim, width, folder, steps):
    """The benchmark's bed from the state of `sim`, for `steps` steps."""
    write_states(sim, width, folder)
    deck = INPUTS / "bed.liggghts.in"
    shutil.copy(deck, folder)  # LIGGGHTS' include takes no path with a space
    block = steps // 11  # the deck relaxes and then times ten blocks
    numbers = {
        "deck": deck.name,
        "width": f"{width:.9e}",
        "relax": steps - 10 * block,
        "block": block,
    }
    numbers["gravity"] = GRAVITY
    version, states = run("bed.in", folder, numbers)
    return version, states[-1]


def run_heap(spec, folder, seed, time):
    """The heap that `spec` describes, poured from another seed (prime, above 10000), at `time`
    [s]."""
    rig = Rig(spec.geometry)
    write_meshes(rig, folder)
    version, states = run("heap.in", folder, heap_variables(spec, rig, seed, time))
    return version, states[-1]


def law_variables(spec):
    """Materials, contacts, rolling law and time step of a deck."""
    particle, wall = material_of(spec.materials.particle), material_of(spec.materials.wall)
    pair, side = spec.contacts.particle_particle, spec.contacts.particle_wall
    return {
        "law": ROLLING[spec.laws.rolling],
        "young": particle.young_modulus,
        "wall_young": wall.young_modulus,
        "poisson": particle.poisson_ratio,
        "wall_poisson": wall.poisson_ratio,
        "density": particle.density,
        "e": pair.restitution,
        "wall_e": side.restitution,
        "mu": pair.static_friction,
        "wall_mu": side.static_friction,
        "mur": pair.rolling_friction,
        "wall_mur": side.rolling_friction,
        "visc": spec.law_parameters.rolling_damping_ratio or 0.0,
        "dt": time_step_of(spec),
    }


def heap_variables(spec, rig, seed, time):
    """What `heap.in` leaves open; grains are made layer by layer as in
    `dem.experiments.heap.Source`."""
    radius, dt = 0.5e-3 * spec.particles.diameter_mm, time_step_of(spec)
    g = spec.geometry
    return law_variables(spec) | {
        "steps": round(time / dt),
        "seed": seed,
        "count": spec.particles.count,
        "rate": g.generation_rate_per_s,
        "speed": g.injection_speed_m_s,
        "every": round(2.2 * radius / g.injection_speed_m_s / dt),
        "radius": radius,
        "mouth": rig.mouth_radius - 0.2 * radius,
        "source_low": rig.source_height - 1.1 * radius,
        "source_high": rig.source_height + 1.1 * radius,
        "skin": 0.2 * radius,
        "side": 3.0 * rig.plate_radius,
        "bottom": rig.lost_height,
        "top": rig.rim_height + COLLAR * rig.mouth_radius + radius,
    }


def write_meshes(rig, folder):
    """plate.stl and funnel.stl [m]: the rig's surfaces of revolution, and the collar above the
    funnel."""
    mouth, rim = rig.mouth_radius, rig.rim_height
    funnel = frustum(rig.orifice_radius, rig.orifice_height, mouth, rim)
    write_mesh(folder / "plate.stl", disc(rig.plate_radius))
    write_mesh(folder / "funnel.stl", funnel + frustum(mouth, rim, mouth, rim + COLLAR * mouth))
