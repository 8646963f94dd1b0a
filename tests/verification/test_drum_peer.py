"""A turning drum in LIGGGHTS, from the grains that ours starts from: the same slope at two Froude
numbers.

LIGGGHTS turns a mesh, a polygon of 64 sides. Its axis is z as ours is, so gravity lies along -y.
The slope is read from its grains by the function that reads ours.
"""

import math

import numpy as np
import pytest

from calibration.engines import bed, liggghts, rig
from calibration.engines.program import find, read_frames, state_of
from calibration.engines.program import run as start
from dem.experiments import drum
from dem.grains.sizes import draw_radii, largest_reach, mean_radius
from dem.run import run as run_ours
from dem.spec import parse_spec
from other_codes import entry_or_skip
from small_heap import RUN

pytestmark = [pytest.mark.peer, pytest.mark.slow]

RATES = (180.0, 360.0)
"""Degrees a second: Froude numbers of 0.02 and 0.08."""
METRICS = ("dynamic_angle_deg", "centre_angle_deg", "passive_rotation_ratio")
SCATTER = (0.33, 0.26, 0.0012)
"""Standard deviation of each metric over seeds 101 to 105 of this engine, the larger one of both
speeds, found before LIGGGHTS ran."""
SEEDS = range(1, 4)
MARGINS = 3.0 * np.sqrt(2.0 / len(SEEDS)) * np.array(SCATTER)
"""Three standard deviations of the difference of two means."""
TOPIC = "rotating drum"
NAMES = ("slope", "angle of the centre of mass", "speed of the carried bed over the drum's,")
UNITS = ("deg", "deg", "")
TURN = """\
{turn}
run {before}
dump turning all custom {every} turning.dump id radius x y z vx vy vz omegax omegay omegaz
run {reading}
"""


def barrel(rate, seed):
    """Half a drum of grains that roll freely, the law that both codes have alike."""
    return parse_spec(
        RUN
        | {
            "experiment": "drum",
            "seed": seed,
            "laws": {"rolling": "none"},
            "particles": {"count": 720, "diameter_mm": 2.0},
            "geometry": {
                "drum_diameter_mm": 40,
                "drum_width_mm": 8,
                "rotation_rate_deg_s": rate,
                "turns": 1.0,
            },
            "numerics": {"max_time_s": 1.0},
        }
    )


def in_liggghts(spec, folder):
    """Metrics of a drum in LIGGGHTS."""
    folder.mkdir()
    shell, reach = drum._Drum(spec), largest_reach(spec)
    rng = np.random.default_rng(spec.seed)
    grains = bed.Grains(spec.materials.particle.density_kg_m3)
    radii = draw_radii(spec, spec.particles.count, rng)
    drum._fill(grains, spec, radii, shell.clear, shell.width, reach, rng)
    rate = math.radians(spec.geometry.rotation_rate_deg_s)
    turn, side = 2.0 * math.pi / rate, shell.radius + bed.ROOM
    every = bed.steps(spec, spec.geometry.turns * turn / drum.LOOKS)
    code = liggghts.OF_FAMILY
    low, high = (-side, -side, -bed.ROOM), (side, side, shell.width + bed.ROOM)
    text = bed.start(spec, grains, code, folder, low, high)
    text = text.replace("vector 0 0 -1", "vector 0 -1 0")
    text += code.walls(shell.walls(), folder) + bed.settle(spec, grains)
    text += TURN.format(
        turn=code.words.turn(drum.SHELL, rate),
        before=bed.steps(spec, spec.geometry.start_turns * turn),
        every=every,
        reading=every * drum.LOOKS,
    )
    (folder / "in.liggghts").write_text(text)
    (folder / "material.in").write_text(rig.block_of(liggghts.block, spec))
    command = [*liggghts.launcher(), find("liggghts", liggghts.INSTALL), "-in", "in.liggghts"]
    start(command, folder, 3600)
    looks = [
        drum._look(bed.Grains(grains.density, state), shell.radius, 2.0 * mean_radius(spec), rate)
        for state in map(state_of, read_frames(folder / "turning.dump"))
    ]
    assert len(looks) >= drum.LOOKS
    return dict(zip(METRICS, np.nanmean(looks, axis=0), strict=True))


@pytest.mark.parametrize(
    "rate",
    # at half the speed the codes take twice the time
    [pytest.param(rate, marks=pytest.mark.long if rate == min(RATES) else ()) for rate in RATES],
)
def test_a_drum_turns_as_ours_does(record, tmp_path, rate):
    entry_or_skip("liggghts")
    ours, theirs = [], []
    for seed in SEEDS:
        spec = barrel(rate, seed)
        found = run_ours(spec, tmp_path / f"ours{seed}")["metrics"]
        ours.append([found[name] for name in METRICS])
        found_there = in_liggghts(spec, tmp_path / f"theirs{seed}")
        theirs.append([found_there[name] for name in METRICS])
    froude = f"at a Froude number of {found['froude_number']:.2g}"
    rows = zip(NAMES, np.mean(ours, 0), np.mean(theirs, 0), MARGINS, UNITS, strict=True)
    for name, own, other, margin, unit in rows:
        record(TOPIC, f"{name} {froude}", own, other, margin, unit, "LIGGGHTS 3.8")
