"""Frames that ParaView opens: grains as points with radius, velocity and number; walls as
surfaces."""

import os
from pathlib import Path

import numpy as np
import pyvista as pv

from dem.linear import length
from dem.walls.geometry import PLANE, RECTANGLE, REVOLVED, TRIANGLE


def grain_points(position, radius, velocity, tag):
    """`pyvista.PolyData` of grains; position, velocity (n, 3), radius, tag (n,). Glyph by `radius`
    to see spheres."""
    if not len(position):
        return pv.PolyData()  # fields without values are refused
    points = pv.PolyData(np.asarray(position, float))
    points["radius"] = np.asarray(radius, float)
    points["velocity"] = np.asarray(velocity, float)
    points["speed"] = length(velocity)
    points["id"] = np.asarray(tag)
    return points


def wall_surface(kind, p, resolution=64):
    """Surface of a wall element in its body's frame, or None for an unbounded plane."""
    if kind == PLANE:
        return None
    if kind == REVOLVED:
        line = pv.Line((p[0], 0.0, p[1]), (p[2], 0.0, p[3]))
        return line.extrude_rotate(resolution=resolution, capping=False)
    if kind == RECTANGLE:
        c, u, v = np.array(p[:3]), np.array(p[3:6]), np.array(p[6:9])
        return pv.Quadrilateral([c - u - v, c + u - v, c + u + v, c - u + v])
    assert kind == TRIANGLE
    return pv.Triangle(np.array(p).reshape(3, 3))


def write_frame(path, sim):
    """Write the grains of a simulation to a .vtp file, atomically."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{os.getpid()}.{path.name}")
    grain_points(sim.position, sim.radius, sim.velocity, sim.tag).save(partial)
    os.replace(partial, path)


def write_walls(path, walls):
    """Write the walls of a `WallSet` to one .vtp file; False when there is nothing bounded to
    draw."""
    origins = {b["name"]: np.asarray(b["origin"], float) for b in walls.bodies}
    parts = []
    for kind, parameters, body in walls.elements:
        surface = wall_surface(kind, parameters)
        if surface is not None:
            parts.append(surface.translate(origins[body]))
    if not parts:
        return False
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    pv.merge(parts).extract_surface(algorithm="dataset_surface").save(path)
    return True
