"""The bulk processes that others chose: their files, what is watched, and the codes' inputs."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bulk import __main__ as command
from benchmarks.bulk import codes
from benchmarks.bulk.cases import LOOK, drum, penetration
from calibration.engines.program import read_frames
from dem.constants import GRAVITY
from other_codes import entry_or_skip

SIDE, BOTTOM = 0.02, -0.08
THICK = 2e-3
SPEED = 5.0


def _triangles(low, high):
    """A box of triangles, open at the top: rows of nine numbers."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    rectangles = [
        ((x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)),
        ((x0, y0, z0), (x0, y1, z0), (x0, y1, z1), (x0, y0, z1)),
        ((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)),
        ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        ((x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1)),
    ]
    return [[*a, *b, *c] for p, q, r, s in rectangles for a, b, c in ((p, q, r), (p, r, s))]


def _table(path, rows, header):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [" ".join(f"{q:.9g}" for q in row) for row in rows]
    path.write_text("\n".join([header, *lines, ""]))


@pytest.fixture
def files(tmp_path):
    """Files of the benchmark in small: a layer of 81 grains in a box and nine above, walls with a
    thickness, four grains in a drum."""
    half, out = SIDE, SIDE + THICK
    inner = _triangles((-half, -half, BOTTOM), (half, half, 0.1))
    outer = _triangles((-out, -out, BOTTOM - THICK), (out, out, 0.1))
    _table(tmp_path / "Penetration" / "walls.txt", inner + outer, "vertices")
    line = np.linspace(-0.016, 0.016, 9)
    rng = np.random.default_rng(5)
    bed = [(1e-3, x, y, BOTTOM + 1.5e-3) for x in line for y in line]
    bed = [(r, x + dx, y + dy, z) for (r, x, y, z), (dx, dy) in zip(
        bed, rng.uniform(-4e-4, 4e-4, (81, 2)), strict=True)]  # fmt: skip
    bed += [(r, x, y, z + 2.3e-3) for r, x, y, z in bed[::9]]  # these meet those below
    path = tmp_path / "Penetration" / "25KParticles.txt"
    _table(path, bed, "Radius[m] PosX[m] PosY[m] PosZ[m]")
    path.write_text(path.read_text() + " 5 0.01 0.01 0 0 0.06\n\n")
    ring = [(0.1 * np.cos(a), -0.03, 0.1 * np.sin(a), 0.1 * np.cos(a + 0.1), 0.03,
             0.1 * np.sin(a + 0.1), 0.102 * np.cos(a), 0.03, 0.102 * np.sin(a))
            for a in np.arange(0, 6.2, 0.1)]  # fmt: skip
    _table(tmp_path / "Drum" / "walls.txt", ring, "vertices")
    drum = [(1e-3, 0.02, 0, 0.02), (2e-3, -0.03, 0, -0.03), (1e-3, 0.02, 0, -0.02),
            (2e-3, 0.03, 0, 0.03)]  # fmt: skip
    _table(tmp_path / "Drum" / "PartCoordinates.txt", drum, "Radius[m] PosX[m] PosY[m] PosZ[m]")
    return tmp_path


def _rows(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def test_a_sphere_falls_freely_until_it_meets_the_bed(files):
    case = replace(penetration(files), looks=4)
    assert len(case.radius) == 91
    outcome = codes.run_here(case, files)
    assert [row["time_s"] for row in outcome.rows] == pytest.approx([0, 5e-4, 1e-3, 1.5e-3, 2e-3])
    for row in outcome.rows:
        fallen = SPEED * row["time_s"] + GRAVITY * row["time_s"] ** 2 / 2
        assert row["height_m"] == pytest.approx(0.06 - fallen, abs=2e-8)
    assert outcome.present == [91] * 4


def test_a_moved_start_moves_the_sphere_alone(files):
    case = penetration(files)
    moved_by = codes.MOVED["dem-moved-3-um"]
    here, moved = (codes.simulation(c).position for c in (case, case.moved(moved_by)))
    assert np.array_equal(here[:-1], moved[:-1])
    assert moved[-1] - here[-1] == pytest.approx([3e-6, 0.0, 0.0], abs=1e-15)


def test_the_drum_has_its_fine_grains_first_and_turns(files):
    case = drum(files)
    assert list(case.material) == ["M1", "M1", "M2", "M2"]
    assert case.materials == ["M1", "M2", "steel"]
    assert case.spin == -2.0
    assert case.regions == ("cylinder y 0 0 0.1 -0.03 0.03",)


def test_runs_and_speeds_are_kept_in_place_of_those_before(files, monkeypatch):
    monkeypatch.setattr(command, "penetration", lambda _: replace(penetration(files), looks=1))
    for _ in range(2):
        command.main([str(files), str(files / "out"), "dem"])
    (row,) = _rows(files / "out" / "runs.csv")
    assert float(row["simulated_s"]) == pytest.approx(5e-4)
    assert int(row["grains"]) == 91
    looks = _rows(files / "out" / "penetration-25K.dem.csv")
    assert [float(look["time_s"]) for look in looks] == pytest.approx([0.0, 5e-4])
    command.main([str(files), str(files / "out"), "dem", "--speed"])
    speeds = _rows(files / "out" / "speeds.csv")
    assert [row["case"] for row in speeds] == ["penetration-25K", "drum"]


def test_lammps_gets_the_moduli_of_two_materials():
    """Hertz: 1/E* = (1 - nu^2)(1/E1 + 1/E2); Mindlin: 1/G* = (2 - nu)(1/G1 + 1/G2), and
    G = E/2.4 for nu = 0.2."""
    words = codes._lammps_law("M1", "M2").split()
    young = 1.0 / (0.96 * (1 / 1e9 + 1 / 0.5e9))
    shear = 1.0 / (1.8 * 2.4 * (1 / 1e9 + 1 / 0.5e9))
    assert float(words[1]) == pytest.approx(4 / 3 * young)
    assert float(words[words.index("mindlin_rescale/force") + 1]) == pytest.approx(8 * shear)
    assert words[2] == "0.45"


@pytest.mark.slow
@pytest.mark.parametrize("code", ["liggghts", "lammps", "yade"])
def test_another_code_has_the_same_fall_and_the_same_bounces(files, code):
    """Before the sphere arrives each grain has bounced on the steel and some on one another, so
    that restitution, stiffness and walls of all codes stand in where they are."""
    entry_or_skip(code)
    case = replace(penetration(files), looks=48)
    sim = codes.simulation(case)
    sim.advance(48 * LOOK)
    ours = sim.position[np.argsort(sim.tag)]
    codes.CODES[code](case, files)
    frame = read_frames(files / "looks.dump")[-1]
    theirs = np.column_stack([frame[axis] for axis in "xyz"])
    assert np.abs(ours - case.position)[:-1, 2].min() > 1e-4
    apart = np.abs(theirs - ours).max(axis=1)
    assert np.quantile(apart, 0.97) < 2e-6
    assert apart.max() < 2e-5  # YADE pushes a grain sideways that meets the edge of two triangles
