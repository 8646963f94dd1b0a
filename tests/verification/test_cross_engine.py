"""This engine beside what LIGGGHTS gave for the same contacts, impacts, beds and heaps
(tests/verification/liggghts).

Recorded with the laws matched; what the two engines do differently within the same law is named
where it shows."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from liggghts import cases, peer, records
from scipy import stats

ONE, BED, HEAP = "LIGGGHTS, one contact", "LIGGGHTS, settled bed", "LIGGGHTS, heap"
PAIRED = np.r_[0 : cases.PAIRS, cases.PAIRS + cases.SINGLES : 2 * cases.PAIRS + cases.SINGLES]
ON_FLOOR = np.arange(cases.PAIRS, cases.PAIRS + cases.SINGLES)
FIRSTS = np.arange(cases.PAIRS + cases.SINGLES)

# LIGGGHTS reads places in ten digits, and an overlap of 1 % of R* has four of them fewer
READING = 1e-4
# LIGGGHTS has the point of contact with a wall half an overlap inside the grain, this engine on the
# wall: half of the overlap here, 1 % of R, in the arm and as much in the surface's speed; a grain
# at rest overlaps by a hundredth of that
WALL_POINT = cases.OVERLAP


def engine_of(name):
    return records.read(name)["engine"].iloc[0]


def torques(name):
    """Force and torque (n, 3) on each grain of the case in both engines: ours, theirs [N], [N
    m]."""
    sim = cases.contacts(name)[0]
    velocity, spin = sim.velocity, sim.spin
    sim.advance(1)
    mass, radius, dt = sim.mass[:, None], sim.radius[:, None], sim.time_step
    ours = (sim.velocity - velocity) * mass / dt, (sim.spin - spin) * 0.4 * mass * radius**2 / dt
    return ours, records.of_case(records.read("contacts"), name)


def worst(ours, theirs, grains):
    """Largest difference of vectors (n, 3) over the size of theirs, among `grains`."""
    size = np.linalg.norm(theirs[grains], axis=1)
    return float((np.linalg.norm((ours - theirs)[grains], axis=1) / size).max())


@pytest.mark.slow
def test_forces_of_one_contact(record):
    (force, torque), (force_l, torque_l) = torques("no rolling resistance")
    source = f"{engine_of('contacts')}, hertz, tangential history"
    for name, ours, theirs in (("force", force, force_l), ("torque", torque, torque_l)):
        for other, grains, known in (("grain", PAIRED, 0.0), ("wall", ON_FLOOR, WALL_POINT)):
            value = worst(ours, theirs, grains)
            quantity = f"largest difference of the {name}, grain on {other}"
            record(ONE, quantity, value, 0.0, READING + known, "", source)


def rolling_part(name):
    """Rolling torque (n, 3) alone, ours and theirs [N m]: with rolling resistance less without."""
    (_, ours), (_, theirs) = torques(name)
    (_, bare), (_, bare_l) = torques("no rolling resistance")
    return ours - bare, theirs - bare_l


@pytest.mark.slow
def test_elastic_plastic_torque_of_one_contact(record):
    """At this instant the spring is empty: what is compared is the dashpot, stiffness and inertia
    under its root."""
    ours, theirs = rolling_part("elastic-plastic")
    source = f"{engine_of('contacts')}, epsd"
    for other, grains, known in (("grain", PAIRED, 0.0), ("wall", ON_FLOOR, WALL_POINT)):
        quantity = f"largest difference of the elastic-plastic torque, grain on {other}"
        record(ONE, quantity, worst(ours, theirs, grains), 0.0, READING + known, "", source)


def load_and_share():
    """Elastic over whole normal force, and rolling part over whole relative spin, of the contacts
    of FIRSTS."""
    sim = cases.contacts("relative")[0]
    x, r, w, half = sim.position, sim.radius, sim.spin, cases.PAIRS
    n = np.tile([0.0, 0.0, 1.0], (len(FIRSTS), 1))
    n[:half] = x[:half] - x[len(FIRSTS) :]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    spin, r_eff = w[FIRSTS], r[FIRSTS]
    spin[:half] -= w[len(FIRSTS) :]
    r_eff[:half] *= r[len(FIRSTS) :] / (r[:half] + r[len(FIRSTS) :])
    rolling = np.cross(n, spin)
    overlap = cases.OVERLAP * r_eff
    elastic = 4.0 / 3.0 * sim.properties[-1].young * np.sqrt(r_eff) * overlap**1.5
    force = torques("relative")[0][0][FIRSTS]
    whole = (force * n).sum(axis=1)
    return elastic / whole, np.linalg.norm(rolling, axis=1) / np.linalg.norm(spin, axis=1)


@pytest.mark.slow
def test_relative_torque_of_one_contact(record):
    """cdt loads the torque with the elastic force alone and divides by the whole relative spin,
    twist included; its manual divides by the rolling part, as we do. With both undone the torques
    are the same."""
    ours, theirs = (np.linalg.norm(t[FIRSTS], axis=1) for t in rolling_part("relative"))
    load, share = load_and_share()
    source = f"{engine_of('contacts')}, cdt"
    ratio = theirs / ours
    quantity = "largest deviation of their relative torque from ours with their load and direction"
    record(ONE, quantity, np.abs(ratio / (load * share) - 1.0).max(), 0.0, READING, "", source)
    for quantity, value in (
        ("mean torque of cdt over the relative torque", ratio.mean()),
        ("of that, elastic over whole normal force, approaching at 0.05 m/s", load.mean()),
        ("of that, rolling part over whole relative spin, spins at random", share.mean()),
    ):
        record(ONE, quantity, value, None, None, "", source)


def after_impact(name):
    """Velocity and spin (n, 3) after the impacts of a case: ours, theirs."""
    sim = cases.impacts(name)[0]
    sim.advance(cases.IMPACT_STEPS)
    return (sim.velocity, sim.spin), records.of_case(records.read("impacts"), name)


def rms(v):
    return float(np.sqrt((v**2).sum(axis=1).mean()))


# name: share of the speed and of the spin that may differ, and why
IMPACT_TOLERANCE = {
    # LIGGGHTS' tangential spring stretches: its force grows with the stiffness; ours keeps its
    # force while loading
    "sliding friction alone": (0.01, 0.05),
    # LIGGGHTS limits the torque by |F_n|, also while the dashpot pulls at the end; ours has no load
    # then
    "rolling alone, elastic-plastic": (1e-6, 0.05),
    # load and direction as above: shown, not judged
    "rolling alone, relative": (1e-6, None),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.IMPACTS)
def test_impacts(record, name):
    (velocity, spin), (velocity_l, spin_l) = after_impact(name)
    source, (share_v, share_w) = engine_of("impacts"), IMPACT_TOLERANCE[name]
    value = rms(velocity - velocity_l) / cases.IMPACT_SPEED
    record(ONE, f"velocity after impact, {name}: rms difference", value, 0.0, share_v, "", source)
    value = rms(spin - spin_l) / rms(spin_l)
    record(ONE, f"spin after impact, {name}: rms difference", value, 0.0, share_w, "", source)


def beside(record, topic, quantity, ours, theirs, judged, unit, source):
    """Mean of ours against mean of theirs: within Welch's 95 % interval of the difference, or only
    shown."""
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    spread = [v.std(ddof=1) for v in (ours, theirs)]
    errors = [s / np.sqrt(len(v)) for s, v in zip(spread, (ours, theirs), strict=True)]
    tolerance = welch_quantile(errors, (len(ours), len(theirs))) * np.hypot(*errors)
    text = f"{quantity} (sd {spread[0]:.2g} and {spread[1]:.2g}, n = {len(ours)} and {len(theirs)})"
    record(topic, text, ours.mean(), theirs.mean(), tolerance if judged else None, unit, source)


def welch_quantile(errors, sizes):
    """Student's 97.5 % quantile at Welch's degrees of freedom, for two standard errors and their
    sample sizes."""
    parts = np.square(errors)
    freedom = parts.sum() ** 2 / (parts**2 / (np.array(sizes) - 1)).sum()
    return stats.t.ppf(0.975, freedom)


NAMES = {
    "angle_of_repose_deg": ("angle of repose, silhouettes", "deg"),
    "radial_angle_deg": ("angle of repose, radial surface", "deg"),
    "height_mm": ("height", "mm"),
    "packing_fraction": ("solid fraction of the middle half", ""),
    "coordination": ("contacts of a grain with others", ""),
    "motion_energy_ratio": ("energy of motion over m g R", ""),
    "spin_energy_ratio": ("energy of spin over m g R", ""),
}
REST = ("motion_energy_ratio", "spin_energy_ratio")
PACKING = ("height_mm", "packing_fraction", "coordination")
SHAPE = ("angle_of_repose_deg", "radial_angle_deg", "height_mm", "coordination")


@pytest.fixture(scope="module")
def as_coded(tmp_path_factory):
    """Metrics of all beds and heaps by this engine with the tangential spring and the relative
    torque of LIGGGHTS."""
    folder = tmp_path_factory.mktemp("as_coded")
    command = [sys.executable, "-m", "liggghts.as_coded", folder / "out.json"]
    own = {"NUMBA_CACHE_DIR": str(folder / "numba"), "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run(command, cwd=Path(__file__).parent, env=os.environ | own, check=True)
    return json.loads((folder / "out.json").read_text())


def compare(record, topic, label, keys, judged, ours, theirs, source):
    """Two sets of runs: `keys` and how far they are at rest; those in `judged` must agree, the rest
    is shown."""
    for key in (*keys, *REST):
        name, unit = NAMES[key]
        columns = ([m[key] for m in side] for side in (ours, theirs))
        beside(record, topic, f"{label}: {name}", *columns, key in judged, unit, source)


def their_beds():
    table = records.read("beds")
    assert list(table["seed"]) == list(cases.SEEDS)
    return table.to_dict("records")


@pytest.mark.long
@pytest.mark.slow
def test_settled_bed_as_liggghts_codes_it(record, as_coded):
    source = f"{engine_of('beds')}, cdt"
    label = "relative as LIGGGHTS codes it, 0.23"
    compare(record, BED, label, PACKING, PACKING, as_coded["beds"], their_beds(), source)


def their_heaps(case):
    """The recorded heaps of a case: metrics and places; angles are read anew from the places of the
    grains."""
    recorded = records.read("heaps").query("case == @case").to_dict("records")
    spec = cases.heap_spec(*cases.HEAPS[case], 1)
    metrics, states = [], []
    for row in recorded:
        position = records.read_grains(case, row["seed"])
        still = np.zeros_like(position)
        states.append((position, still, still, np.full(len(position), cases.radius_of(spec))))
        pile = cases.measure_pile(states[-1], spec)
        # places to a micrometre tell the shape, not which grains touch or how they move
        metrics.append(
            row | {k: pile[k] for k in ("angle_of_repose_deg", "radial_angle_deg", "height_mm")}
        )
    return metrics, states


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("case", cases.HEAPS)
def test_heap_as_liggghts_codes_it(record, as_coded, case):
    law = peer.ROLLING[cases.HEAPS[case][0]]
    label = case.replace(",", " as LIGGGHTS codes it,")
    ours, theirs = as_coded["heaps"][case], their_heaps(case)[0]
    compare(record, HEAP, label, SHAPE, SHAPE, ours, theirs, f"{engine_of('heaps')}, {law}")
