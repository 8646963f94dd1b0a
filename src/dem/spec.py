"""The run spec: everything that determines one run, with its unit in each key's name.

`load_spec` reads a YAML file, `parse_spec` a mapping; both raise one `SpecError` that names the key, its value and
what is allowed.
"""

import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator
from pydantic_core import PydanticCustomError

from dem.dumbbell import MAX_ELONGATION, sphere_radius
from dem.errors import SpecError
from dem.io.mapping import line_of, read_mapping
from dem.timescales import rayleigh_time
from dem.units import UnitError, converted

MAX_SIZE_RATIO = 10.0
MIN_ORIFICE_RATIO = 3.0  # orifice over largest grain; below it any funnel clogs
MAX_RAYLEIGH_FRACTION = 0.8
ELONGATED = ("heap", "shear")  # experiments that can be run with elongated grains


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_boolean(cls, value):
        """YAML's yes, no, on, off would otherwise pass as 1 and 0."""
        if isinstance(value, bool):
            raise PydanticCustomError("boolean", "a number or a word, not true or false")
        return value


def _field(default, description, **limits):
    return Field(default, description=description, **limits)


class MaterialSpec(_Part):
    """Elastic constants and density of a material."""

    density_kg_m3: float = _field(1210.0, "density of the grain", gt=0)
    shear_modulus_Pa: float = _field(1.0e7, "shear modulus; softened values save time steps", gt=0)
    poisson_ratio: float = _field(0.25, "Poisson's ratio", ge=0, lt=0.5)


class WallMaterialSpec(MaterialSpec):
    """Steel by default (Table 4 of the paper)."""

    density_kg_m3: float = _field(7800.0, "density of the wall", gt=0)
    shear_modulus_Pa: float = _field(8.0e10, "shear modulus of the wall", gt=0)
    poisson_ratio: float = _field(0.30, "Poisson's ratio of the wall", ge=0, lt=0.5)


class Materials(_Part):
    """Grains and walls."""

    particle: MaterialSpec = MaterialSpec()
    wall: WallMaterialSpec = WallMaterialSpec()


class ContactSpec(_Part):
    """Contact parameters of a pair of materials."""

    restitution: float = _field(0.544, "coefficient of restitution", ge=0.03, le=1)
    static_friction: float = _field(0.85, "coefficient of static friction", ge=0, le=5)
    rolling_friction: float = _field(0.23, "coefficient of rolling friction", ge=0, le=5)


class WallContactSpec(ContactSpec):
    """Grain on wall: the paper's calibrated values by default."""

    restitution: float = _field(0.421, "coefficient of restitution, grain on wall", ge=0.03, le=1)
    static_friction: float = _field(
        0.71, "coefficient of static friction, grain on wall", ge=0, le=5
    )
    rolling_friction: float = _field(
        0.368, "coefficient of rolling friction, grain on wall", ge=0, le=5
    )


class Contacts(_Part):
    """Both kinds of contact."""

    particle_particle: ContactSpec = ContactSpec()
    particle_wall: WallContactSpec = WallContactSpec()


class LawsSpec(_Part):
    """One law in each slot of the contact."""

    normal: Literal["hertz"] = "hertz"
    damping: Literal["tsuji", "thornton", "viscoelastic", "plastic"] = "tsuji"
    tangential: Literal["mindlin"] = "mindlin"
    friction: Literal["constant", "stress_dependent"] = "constant"
    rolling: Literal["none", "constant_torque", "constant_torque_relative", "elastic_plastic"] = (
        "constant_torque"
    )
    cohesion: Literal["none", "sjkr", "jkr", "liquid_bridge"] = "none"
    drag: Literal["none", "schiller_naumann"] = "none"


class LawParameters(_Part):
    """Constants that the chosen laws need beyond the materials and contacts."""

    cohesion_energy_density_J_m3: float | None = _field(None, "sjkr, grain on grain", ge=0)
    wall_cohesion_energy_density_J_m3: float | None = _field(None, "sjkr, grain on wall", ge=0)
    surface_energy_J_m2: float | None = _field(None, "jkr, per surface, grain on grain", ge=0)
    wall_surface_energy_J_m2: float | None = _field(None, "jkr, per surface, grain on wall", ge=0)
    surface_tension_N_m: float | None = _field(None, "liquid_bridge", gt=0)
    contact_angle_deg: float | None = _field(None, "liquid_bridge", ge=0, lt=90)
    liquid_volume_fraction: float | None = _field(
        None, "liquid_bridge: bridge over grain volume, grain on grain", ge=0, le=0.1
    )
    wall_liquid_volume_fraction: float | None = _field(
        None, "liquid_bridge: bridge over grain volume, grain on wall", ge=0, le=0.1
    )
    viscoelastic_time_s: float | None = _field(None, "viscoelastic: dissipation time A", gt=0)
    yield_velocity_m_s: float | None = _field(None, "plastic: speed above which e falls", gt=0)
    friction_exponent: float | None = _field(None, "stress_dependent: n", ge=0, le=1 / 3 + 1e-9)
    friction_reference_force_N: float | None = _field(None, "stress_dependent: F0", gt=0)
    air_density_kg_m3: float | None = _field(None, "schiller_naumann, 1.2 unless given", gt=0)
    air_viscosity_Pa_s: float | None = _field(None, "schiller_naumann, 1.8e-5 unless given", gt=0)
    rolling_stiffness_factor: float | None = _field(
        None, "elastic_plastic, 2.25 unless given", gt=0
    )
    rolling_damping_ratio: float | None = _field(None, "elastic_plastic, 0.3 unless given", ge=0)


REQUIRED = {
    ("damping", "viscoelastic"): [("viscoelastic_time_s",)],
    ("damping", "plastic"): [("yield_velocity_m_s",)],
    ("friction", "stress_dependent"): [("friction_exponent",), ("friction_reference_force_N",)],
    ("cohesion", "sjkr"): [("cohesion_energy_density_J_m3", "wall_cohesion_energy_density_J_m3")],
    ("cohesion", "jkr"): [("surface_energy_J_m2", "wall_surface_energy_J_m2")],
    ("cohesion", "liquid_bridge"): [
        ("surface_tension_N_m",),
        ("liquid_volume_fraction", "wall_liquid_volume_fraction"),
    ],
}
"""Law -> groups of parameters of which at least one must be given."""

OPTIONAL = {
    ("cohesion", "liquid_bridge"): ["contact_angle_deg"],
    ("drag", "schiller_naumann"): ["air_density_kg_m3", "air_viscosity_Pa_s"],
    ("rolling", "elastic_plastic"): ["rolling_stiffness_factor", "rolling_damping_ratio"],
}


class Sizes(_Part):
    """A size distribution."""

    by: Literal["number", "mass"] = _field("number", "what the fractions are shares of")
    diameters_mm: list[Annotated[float, Field(gt=0)]] = Field(min_length=1)
    fractions: list[Annotated[float, Field(ge=0)]] = Field(min_length=1)


class Particles(_Part):
    """The grains."""

    count: int = _field(10000, "number of grains", ge=1, le=5_000_000)
    diameter_mm: float = _field(2.0, "diameter of mono-sized grains", gt=0)
    sizes: Sizes | None = _field(None, "size distribution in place of one diameter")
    scale_factor: float = _field(1.0, "multiplies all diameters", gt=0)
    elongation: float = _field(
        1.0,
        "length over width; above 1 a grain is two bonded spheres with the volume of one of its diameter",
        ge=1,
        le=MAX_ELONGATION,
    )


class HeapGeometry(_Part):
    """Funnel and plate (section 2.2.2 of the paper; flank and mouth of the funnel are not given there)."""

    orifice_diameter_mm: float = _field(20.0, "orifice of the funnel", gt=0)
    plate_diameter_mm: float = _field(80.0, "base plate", gt=0)
    discharge_height_mm: float = _field(75.0, "orifice above the plate", gt=0)
    funnel_half_angle_deg: float = _field(30.0, "flank from the vertical", gt=0, lt=90)
    funnel_top_diameter_mm: float = _field(80.0, "mouth of the funnel", gt=0)
    generation_rate_per_s: float = _field(10000.0, "grains made per second", gt=0)
    injection_speed_m_s: float = _field(0.3, "downward speed of new grains", gt=0)
    funnel_stl: str | None = _field(None, "mesh [mm] in place of the analytic funnel")
    plate_stl: str | None = _field(None, "mesh [mm] in place of the analytic plate")
    meshes: Literal["closed", "open"] = _field(
        "closed", "whether meshes may have free edges, as a dish or a funnel of no thickness has"
    )


class DropGeometry(_Part):
    """Drop test (2.3.3)."""

    drop_height_mm: float = _field(150.0, "lowest point of the grain above the plate", gt=0)
    drops: int = _field(5, "independent drops, at different phases of the time step", ge=1, le=1000)
    output_interval_s: float | None = _field(
        None, "read heights at these instants only, as a coarse output would", gt=0
    )


class TiltGeometry(_Part):
    """Tilted plane (2.3.2)."""

    tilt_rate_deg_s: float = _field(5.0, "speed of tilting", gt=0, le=90)
    plate_length_mm: float = _field(80.0, "plate along the slope", gt=0)
    plate_width_mm: float = _field(60.0, "plate across the slope", gt=0)
    spacing_mm: float | None = _field(
        None, "half distance of bonded grains; touching unless given", gt=0
    )
    slip_mm: float = _field(0.05, "movement along the plate that counts as sliding", gt=0)
    trials: int = _field(5, "trials with the cluster turned at random", ge=1, le=100)


class ShearGeometry(_Part):
    """Ring shear cell (2.3.4)."""

    inner_diameter_mm: float = _field(20.0, "inner wall of the ring", gt=0)
    outer_diameter_mm: float = _field(44.0, "outer wall of the ring", gt=0)
    normal_stress_kPa: float = _field(2.0, "test load", gt=0)
    preshear_normal_stress_kPa: float | None = _field(
        None, "pre-shear load; the test load unless given", gt=0
    )
    shear_speed_mm_s: float = _field(30.0, "speed of the trough at the mean radius", gt=0)
    preshear_displacement_mm: float = _field(4.0, "pre-shear path at the mean radius", gt=0)
    shear_displacement_mm: float = _field(6.0, "shear path at the mean radius", gt=0)


class Numerics(_Part):
    """Numerical choices; they are recorded with each result."""

    rayleigh_fraction: float = _field(
        0.4,
        "time step over the Rayleigh time of the smallest grain",
        gt=0,
        le=MAX_RAYLEIGH_FRACTION,
    )
    time_step_s: float | None = _field(None, "time step in place of the fraction", gt=0)
    precision: Literal["mixed", "double"] = _field("mixed", "float32 forces, or float64 throughout")
    rest_energy_ratio: float = _field(
        1e-5, "kinetic energy over m g R at which the heap rests", gt=0
    )
    max_time_s: float = _field(12.0, "end of the run at the latest (2.2.2: 12 s)", gt=0)
    skin: float = _field(0.05, "skin of the pair list over the radius, at rest", gt=0, le=1)
    skin_horizon: int = _field(40, "steps of present speed that the skin allows for", ge=1, le=1000)
    overlap_limit: float = _field(
        0.3, "overlap over radius that stops a run as blown up", gt=0, le=1
    )


class Output(_Part):
    """What a run writes beside its result."""

    frame_interval_s: float | None = _field(
        None, "simulated time between VTK frames; none unless given", gt=0
    )
    checkpoint_interval_s: float = _field(60.0, "wall time between checkpoints", gt=0)


GEOMETRY = {
    "heap": HeapGeometry,
    "drop": DropGeometry,
    "tilt": TiltGeometry,
    "shear": ShearGeometry,
}


class RunSpec(_Part):
    """One run."""

    experiment: Literal["heap", "drop", "tilt", "shear"]
    seed: int = _field(1, "seed of all random draws", ge=0, lt=2**63)
    materials: Materials = Materials()
    contacts: Contacts = Contacts()
    laws: LawsSpec = LawsSpec()
    law_parameters: LawParameters = LawParameters()
    particles: Particles = Particles()
    geometry: HeapGeometry | DropGeometry | TiltGeometry | ShearGeometry
    numerics: Numerics = Numerics()
    output: Output = Output()


RAYLEIGH_FRACTION = {"heap": 0.4, "drop": 0.05, "tilt": 0.4, "shear": 0.3}
"""Default by experiment: a drop is over in one contact, which must be resolved (44 steps at 1.7 m/s)."""


def parse_spec(data, file=None):
    """`RunSpec` from a mapping. Raises SpecError for the first thing that is wrong."""
    if not isinstance(data, dict):
        raise SpecError("(top level)", data, "a mapping of keys", file)
    try:
        data = converted(data)
    except UnitError as error:
        raise SpecError(error.key, error.value, str(error), file) from None
    kind = data.get("experiment")
    if not isinstance(kind, str) or kind not in GEOMETRY:
        raise SpecError("experiment", kind, ", ".join(GEOMETRY), file)
    try:
        geometry = GEOMETRY[kind].model_validate(data.get("geometry") or {})
    except ValidationError as error:
        raise _first_error(error, file, GEOMETRY[kind], "geometry") from None
    data["geometry"] = geometry
    numerics = data.get("numerics") or {}
    if isinstance(numerics, dict):
        data["numerics"] = {"rayleigh_fraction": RAYLEIGH_FRACTION[kind]} | numerics
    try:
        spec = RunSpec.model_validate({k: v for k, v in data.items() if v is not None})
    except ValidationError as error:
        raise _first_error(error, file, RunSpec, None) from None
    _check_laws(spec, file)
    _check_sizes(spec, file)
    _check_shape(spec, file)
    _check_time_step(spec, file)
    _GEOMETRY_CHECKS[kind](spec, file)
    return spec


def load_spec(path):
    """`RunSpec` from a YAML file. Raises SpecError; the file's name and the line of the key are part of the message."""
    data, lines = read_mapping(path)
    try:
        return parse_spec(data, file=str(path))
    except SpecError as error:
        line = line_of(error.key, lines)
        if line is None:
            raise
        where = f"{path}, line {line}"
        raise SpecError(error.key, error.value, error.allowed, where) from None


def _first_error(error, file, model, prefix):
    first = error.errors()[0]
    path = [str(p) for p in first["loc"]]
    if prefix:
        path.insert(0, prefix)
    key, value = ".".join(path), first.get("input")
    if first["type"] == "extra_forbidden":
        return SpecError(
            key, value, f"one of the keys {', '.join(_keys_beside(model, first['loc']))}", file
        )
    if first["type"] == "missing":
        return SpecError(key, None, "this key must be given", file)
    if first["type"] == "model_type":
        return SpecError(key, value, "a mapping of keys", file)
    message = first["msg"][0].lower() + first["msg"][1:]
    return SpecError(key, value, message.removeprefix("input should be "), file)


def _keys_beside(model, loc):
    """Keys that are known where the last part of `loc` was not."""
    for part in loc[:-1]:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        options = [annotation, *getattr(annotation, "__args__", ())]
        model = next(
            (o for o in options if isinstance(o, type) and issubclass(o, BaseModel)), model
        )
    return list(model.model_fields)


def _check_laws(spec, file):
    given = {k for k, v in spec.law_parameters.model_dump().items() if v is not None}
    useful = set()
    for (slot, law), groups in REQUIRED.items():
        if getattr(spec.laws, slot) != law:
            continue
        for group in groups:
            useful.update(group)
            if not given & set(group):
                wanted = " or ".join(group)
                raise SpecError(f"laws.{slot}", law, f"only with law_parameters.{wanted}", file)
    for (slot, law), names in OPTIONAL.items():
        if getattr(spec.laws, slot) == law:
            useful.update(names)
    for name in sorted(given - useful):
        owners = [
            f"laws.{slot}: {law}"
            for (slot, law), groups in REQUIRED.items()
            if any(name in g for g in groups)
        ] + [f"laws.{slot}: {law}" for (slot, law), names in OPTIONAL.items() if name in names]
        value = getattr(spec.law_parameters, name)
        raise SpecError(f"law_parameters.{name}", value, f"only with {' or '.join(owners)}", file)
    if spec.laws.cohesion == "jkr" and spec.laws.damping != "tsuji":
        raise SpecError("laws.damping", spec.laws.damping, "tsuji where laws.cohesion is jkr", file)


def _check_sizes(spec, file):
    s = spec.particles.sizes
    if s is None:
        return
    if len(s.diameters_mm) != len(s.fractions):
        allowed = f"as many as particles.sizes.diameters_mm ({len(s.diameters_mm)})"
        raise SpecError("particles.sizes.fractions", s.fractions, allowed, file)
    if not math.isclose(sum(s.fractions), 1.0, abs_tol=1e-6):
        raise SpecError("particles.sizes.fractions", s.fractions, "fractions that sum to 1", file)
    if max(s.diameters_mm) > MAX_SIZE_RATIO * min(s.diameters_mm):
        allowed = f"a ratio of largest to smallest of at most {MAX_SIZE_RATIO:g}"
        raise SpecError("particles.sizes.diameters_mm", s.diameters_mm, allowed, file)


def _check_shape(spec, file):
    elongation = spec.particles.elongation
    if elongation != 1.0 and spec.experiment not in ELONGATED:
        allowed = f"1 in this experiment; elongated grains are for {' and '.join(ELONGATED)}"
        raise SpecError("particles.elongation", elongation, allowed, file)


def _diameters(spec):
    """Diameters [mm] of the spheres that grains are made of."""
    p = spec.particles
    sizes = [p.diameter_mm] if p.sizes is None else p.sizes.diameters_mm
    return [sphere_radius(p.scale_factor * d, p.elongation) for d in sizes]


def _longest(spec):
    """Length [mm] of the largest grain."""
    return spec.particles.elongation * max(_diameters(spec))


def _check_time_step(spec, file):
    m, dt = spec.materials.particle, spec.numerics.time_step_s
    if dt is None:
        return
    smallest = 0.5e-3 * min(_diameters(spec))
    limit = MAX_RAYLEIGH_FRACTION * rayleigh_time(
        smallest, m.density_kg_m3, m.shear_modulus_Pa, m.poisson_ratio
    )
    if dt > limit:
        allowed = (
            f"at most {limit:.4g} s, {MAX_RAYLEIGH_FRACTION} of the smallest grain's Rayleigh time"
        )
        raise SpecError("numerics.time_step_s", dt, allowed, file)


def _check_funnel(spec, file):
    g, largest = spec.geometry, _longest(spec)
    if g.orifice_diameter_mm < MIN_ORIFICE_RATIO * largest:
        allowed = f"at least {MIN_ORIFICE_RATIO:g} times the largest grain ({largest:g} mm)"
        raise SpecError("geometry.orifice_diameter_mm", g.orifice_diameter_mm, allowed, file)
    if g.funnel_top_diameter_mm <= g.orifice_diameter_mm:
        allowed = f"more than the orifice ({g.orifice_diameter_mm:g} mm)"
        raise SpecError("geometry.funnel_top_diameter_mm", g.funnel_top_diameter_mm, allowed, file)
    if g.plate_diameter_mm < 4 * largest:
        allowed = f"at least four of the largest grain ({largest:g} mm)"
        raise SpecError("geometry.plate_diameter_mm", g.plate_diameter_mm, allowed, file)
    pouring = spec.particles.count / g.generation_rate_per_s
    if spec.numerics.max_time_s <= pouring:
        allowed = f"more than the {pouring:g} s in which particles.count grains are made"
        raise SpecError("numerics.max_time_s", spec.numerics.max_time_s, allowed, file)


def _check_plate(spec, file):
    """The bonded cluster must lie on the tilting plate however it is turned."""
    g, largest = spec.geometry, _longest(spec)
    half_distance = 0.5 * largest if g.spacing_mm is None else g.spacing_mm
    needed = 2.0 * math.sqrt(2.0) * half_distance + largest
    for key in ("plate_length_mm", "plate_width_mm"):
        if getattr(g, key) < needed:
            allowed = f"at least {needed:.4g}, the size of the bonded cluster"
            raise SpecError(f"geometry.{key}", getattr(g, key), allowed, file)


def _check_ring(spec, file):
    g, largest = spec.geometry, _longest(spec)
    needed = g.inner_diameter_mm + 4.0 * largest
    if g.outer_diameter_mm < needed:
        allowed = f"at least {needed:g}: a gap of two of the largest grain ({largest:g} mm)"
        raise SpecError("geometry.outer_diameter_mm", g.outer_diameter_mm, allowed, file)


_GEOMETRY_CHECKS = {
    "heap": _check_funnel,
    "drop": lambda spec, file: None,
    "tilt": _check_plate,
    "shear": _check_ring,
}


def canonical(spec):
    """Canonical JSON of what determines the run's result: not `output`; of a mesh the content, not the path; whether
    meshes may be open only where there is one."""
    data = spec.model_dump(mode="json", exclude={"output"})
    geometry = data["geometry"]
    named = {k: v for k, v in geometry.items() if k.endswith("_stl") and v is not None}
    for key, path in named.items():
        if Path(path).is_file():
            geometry[key] = hashlib.sha256(Path(path).read_bytes()).hexdigest()
    if not named:
        geometry.pop("meshes", None)
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def content_hash(spec):
    """First 16 hex digits of the SHA-256 of `canonical`."""
    return hashlib.sha256(canonical(spec).encode()).hexdigest()[:16]
