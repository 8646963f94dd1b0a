"""The rig of the calibrated runs for a program that is filled in by hand: its walls with their
places, where and how grains are made, and how long it runs."""

from collections.abc import Iterator

from calibration.engines.blocks.by_hand import Row, table
from dem.experiments.heap import Rig
from dem.part import Part
from dem.spec import RunSpec
from dem.units import in_ascii, unit_of

AXES = "z points up; x = y = z = 0 is the middle of the plate's upper face. Lengths in mm."


def geometries(spec: RunSpec) -> list[str]:
    """Paragraphs on the walls. A funnel heap has its walls with their places, any other experiment
    the keys of its run spec with what they mean."""
    if spec.experiment != "heap":
        words = f"The rig is this project's experiment `{spec.experiment}`:"
        return [words, table(list(_keys(spec.geometry)))]
    g, rig = spec.geometry, Rig(spec.geometry)
    rows = [
        Row("Plate: a disc, radius", 1e3 * rig.plate_radius, "mm"),
        Row("Plate: z", 0.0, "mm"),
        Row("Funnel: orifice, radius", 1e3 * rig.orifice_radius, "mm"),
        Row("Funnel: orifice, z", 1e3 * rig.orifice_height, "mm"),
        Row("Funnel: mouth, radius", 1e3 * rig.mouth_radius, "mm"),
        Row("Funnel: mouth, z", 1e3 * rig.rim_height, "mm"),
        Row("Funnel: flank from the vertical", g.funnel_half_angle_deg, "deg"),
        Row("Collar above the mouth: a tube up to z", 1e3 * rig.collar_height, "mm"),
    ]
    if rig.plate_rim:
        rows.append(Row("Rim around the plate: a tube up to z", 1e3 * rig.plate_rim, "mm"))
    out = [AXES, table(rows)]
    meshes = [m for m in (g.funnel_stl, g.plate_stl) if m]
    if meshes:
        out.append(f"In place of these walls import {' and '.join(f'`{m}`' for m in meshes)} [mm].")
    lost = f"Grains below z = {1e3 * rig.lost_height:.6g} mm have spilled: end the domain there."
    return [*out, lost]


def _keys(part: Part, prefix: str = "") -> Iterator[Row]:
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        if value is None:
            continue
        if isinstance(value, Part):
            yield from _keys(value, f"{prefix}{name}.")
            continue
        words = f"{field.description or name} (`{prefix}{name}`)"
        number = value if isinstance(value, int | float) else str(value)
        yield Row(words, number, "" if isinstance(number, str) else in_ascii(unit_of(name)))


def factory(spec: RunSpec) -> list[str]:
    """Paragraphs on where and how fast grains are made."""
    if spec.experiment != "heap":
        return [f"{spec.particles.count} grains, made as the experiment `{spec.experiment}` does."]
    g, rig = spec.geometry, Rig(spec.geometry)
    rows = [
        Row("Factory type", "dynamic"),
        Row("Section: a virtual disc, radius", 1e3 * rig.mouth_radius, "mm"),
        Row("Section: z", 1e3 * rig.source_height, "mm"),
        Row("Total number", spec.particles.count),
        Row("Target number (per second)", g.generation_rate_per_s, "1/s"),
        Row("Start time", 0.0, "s"),
        Row("Position", "random"),
        Row("Velocity: fixed, z", -g.injection_speed_m_s, "m/s"),
    ]
    out = [table(rows)]
    if rig.opened:
        out.append(
            "The orifice is closed by a disc while the grains are made. The disc is removed when "
            "they rest."
        )
    return out


def simulation_time(spec: RunSpec) -> list[Row]:
    """Rows on the length of the run: the pour, and the end at the latest."""
    end = Row("Total time, at the latest", spec.numerics.max_time_s, "s")
    if spec.experiment != "heap":
        return [end]
    pour = spec.particles.count / spec.geometry.generation_rate_per_s
    return [Row("Last grain made after", pour, "s"), end]
