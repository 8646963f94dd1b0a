"""Files: written whole or not at all, meshes in both STL dialects, frames that ParaView opens, and
tables that a spreadsheet opens without a formula."""

import csv
import io
import os

import numpy as np
import pandas as pd
import pytest

from calibration.files import csv_text, write_table
from dem.errors import MeshError
from dem.experiments.heap import HeapGeometry, Rig
from dem.io import files
from dem.io.files import write_json
from dem.io.stl import read_stl, write_stl
from dem.io.vtk import write_frame, write_grains, write_walls
from dem.tables.limits import FARTHEST_MM, KINDS, MOST_TRIANGLES
from facts import refused
from scenes import revolved
from vtk_files import read_vtp


class Grains:
    """As much of a simulation as a frame shows."""

    position = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 2.0]])
    radius = np.array([1e-3, 2e-3])
    velocity = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    tag = np.array([7, 3])


def test_names_are_on_the_disk_when_a_file_is_in_its_place(tmp_path, monkeypatch):
    """Bytes first, then the name, then each folder that has a new name: what a power cut asks."""
    done, inode = [], {}
    fsync, replace = files.os.fsync, files.os.replace

    def synced(handle):
        done.append(("sync", os.fstat(handle).st_ino))
        fsync(handle)

    def replaced(source, target):
        inode["file"] = os.stat(source).st_ino
        done.append(("rename", inode["file"]))
        replace(source, target)

    monkeypatch.setattr(files.os, "fsync", synced)
    monkeypatch.setattr(files.os, "replace", replaced)
    write_json(tmp_path / "a" / "b" / "x.json", {})
    folders = [p.stat().st_ino for p in (tmp_path / "a" / "b", tmp_path / "a", tmp_path)]
    assert done[:2] == [("sync", inode["file"]), ("rename", inode["file"])]
    assert [n for _, n in done[2:]] == folders


def binary(corners):
    """Bytes of an STL file with these corners (t, 3, 3), as the format has it."""
    record = np.zeros(len(corners), [("v", "<f4", (4, 3)), ("a", "<u2")])
    record["v"][:, 1:] = corners
    return b" " * 80 + np.uint32(len(corners)).tobytes() + record.tobytes()


def test_a_binary_mesh_beyond_any_rig_is_refused_by_the_triangle(tmp_path):
    path, corners = tmp_path / "a.stl", np.tile(np.eye(3), (3, 1, 1))
    for value in (2.0 * FARTHEST_MM, np.nan):
        corners[1, 2, 2] = value
        path.write_bytes(binary(corners))
        with refused(MeshError, "triangle 2", file="a.stl"):
            read_stl(path)
    path.write_bytes(binary(np.tile(np.eye(3), (MOST_TRIANGLES + 1, 1, 1))))
    with refused(MeshError, "300,000", value=MOST_TRIANGLES + 1):
        read_stl(path)
    path.write_bytes(binary(corners)[:-1])
    with refused(MeshError, "cut off", file="a.stl"):
        read_stl(path)
    with open(path, "wb") as stream:
        stream.truncate(KINDS["mesh"].most + 1)
    with refused(MeshError, "16 MB", file="a.stl"):
        read_stl(path)


def test_a_binary_mesh_comes_back_welded_and_scaled(tmp_path):
    vertices, triangles = revolved([(10.0, 75.0), (40.0, 127.0)], 24)
    write_stl(tmp_path / "funnel.stl", vertices, triangles)
    v, t = read_stl(tmp_path / "funnel.stl", scale=1e-3)
    assert (len(v), len(t)) == (48, 48)
    assert np.allclose(
        np.sort(v[t].ravel()), np.sort(1e-3 * vertices[triangles].ravel()), atol=1e-8
    )


def test_a_frame_reads_back_with_every_field(tmp_path):
    write_frame(tmp_path / "frames" / "grains_00000.vtp", Grains)
    frame = read_vtp(tmp_path / "frames" / "grains_00000.vtp")
    assert np.allclose(frame["Points"], Grains.position)
    assert np.allclose(frame["radius"], Grains.radius)
    assert np.allclose(frame["velocity"], Grains.velocity)
    assert frame["speed"].tolist() == [5.0, 0.0]
    assert frame["id"].tolist() == [7, 3]
    assert frame["Verts"].tolist() == [1, 2]
    assert [p.name for p in (tmp_path / "frames").iterdir()] == ["grains_00000.vtp"]


def test_a_frame_without_grains_can_be_written(tmp_path):
    path = tmp_path / "none.vtp"
    write_grains(path, np.empty((0, 3)), np.empty(0), np.empty((0, 3)), np.empty(0))
    assert read_vtp(path)["Points"].shape == (0, 3)


def test_the_walls_of_the_heap_are_drawn_in_their_places(tmp_path):
    assert write_walls(tmp_path / "walls.vtp", Rig(HeapGeometry()).walls())
    points = read_vtp(tmp_path / "walls.vtp")["Points"]
    (x0, y0, z0), (x1, y1, z1) = points.min(0), points.max(0)
    assert (x0, x1, y0, y1) == pytest.approx((-0.04, 0.04, -0.04, 0.04), abs=1e-4)
    assert z0 == pytest.approx(0.0, abs=1e-6)
    assert z1 == pytest.approx(0.075 + 0.030 / np.tan(np.radians(30.0)) + 0.1, rel=1e-4)
    orifice = np.hypot(*points[np.abs(points[:, 2] - 0.075) < 1e-5][:, :2].T)
    assert orifice == pytest.approx(0.010, rel=1e-4)


FORMULAS = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1"]


@pytest.mark.parametrize("cell", FORMULAS)
def test_no_cell_and_no_heading_is_a_formula(cell, tmp_path):
    table = pd.DataFrame({"note": [cell, "plain"], cell: [1.5, -2.5]})
    write_table(table, tmp_path / "t.csv")
    text = (tmp_path / "t.csv").read_bytes().decode()
    cells = [c for row in csv.reader(io.StringIO(text, newline="")) for c in row]
    assert not [c for c in cells if c.strip()[:1] in tuple("=+@")]
    assert [c for c in cells if c.startswith("-")] == ["-2.5"]


def test_numbers_and_words_come_back_as_they_were():
    table = pd.DataFrame({"x": [-1.0, 2.5e-9], "name": ["a-b", "+1.5"], "n": [1, -2]})
    pd.testing.assert_frame_equal(
        pd.read_csv(io.StringIO(csv_text(table)), dtype={"name": str}), table
    )
