"""The run spec: everything that determines one run, with its unit in each key's name.

`load_spec` reads a YAML file, `parse_spec` a mapping; both raise one `SpecError` that names the
key, its value and what is allowed.
"""

import hashlib
import json
import math
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, Union

from pydantic import BaseModel, Field, ValidationError, create_model, model_validator

from dem.contact.catalogue import LAWS, completed, every_law, groups_needed, keys_allowed
from dem.contact.law import Law
from dem.errors import SpecError
from dem.experiments import experiment_of, experiments, source_outside
from dem.grains import sphere
from dem.grains.clump import fault, shape_of
from dem.grains.dumbbell import MAX_ELONGATION
from dem.grains.sizes import classes, rayleigh_of, smallest_radius, spheres_in
from dem.io.files import digest_of
from dem.io.grain_tables import COLUMNS, read_clump, read_sizes
from dem.io.mapping import line_of, read_mapping
from dem.materials import contact_parameters, laws_of
from dem.schema import Part, field
from dem.units import UnitError, converted

MAX_SIZE_RATIO = 10.0
MAX_RAYLEIGH_FRACTION = 0.8
LIGHTEST = 1e-18  # kg
GIVEN = "this key must be given"


class MaterialSpec(Part):
    """Elastic constants and density of a material. A file gives those of the grains: the defaults
    are an example's."""

    density_kg_m3: float = field(1500.0, "density of the grain", gt=0)
    shear_modulus_Pa: float = field(1.0e7, "shear modulus; softened values save time steps", gt=0)
    poisson_ratio: float = field(0.25, "Poisson's ratio", ge=0, lt=0.5)


class WallMaterialSpec(MaterialSpec):
    """Steel by default."""

    density_kg_m3: float = field(7800.0, "density of the wall", gt=0)
    shear_modulus_Pa: float = field(8.0e10, "shear modulus of the wall", gt=0)
    poisson_ratio: float = field(0.30, "Poisson's ratio of the wall", ge=0, lt=0.5)


class Materials(Part):
    """Grains and walls."""

    particle: MaterialSpec = MaterialSpec()
    wall: WallMaterialSpec = WallMaterialSpec()


class ContactSpec(Part):
    """Contact parameters of a pair of materials. A file gives them: the defaults are an
    example's."""

    restitution: float = field(0.5, "coefficient of restitution", ge=0.03, le=1)
    static_friction: float = field(0.5, "coefficient of static friction", ge=0, le=5)
    rolling_friction: float = field(0.2, "coefficient of rolling friction", ge=0, le=5)


class WallContactSpec(ContactSpec):
    """Grain on wall."""

    restitution: float = field(0.5, "coefficient of restitution, grain on wall", ge=0.03, le=1)
    static_friction: float = field(0.5, "coefficient of static friction, grain on wall", ge=0, le=5)
    rolling_friction: float = field(
        0.2, "coefficient of rolling friction, grain on wall", ge=0, le=5
    )


class Contacts(Part):
    """Both kinds of contact."""

    particle_particle: ContactSpec = ContactSpec()
    particle_wall: WallContactSpec = WallContactSpec()


class _Laws(Part):
    """Slots that are not named have their default, see `dem.contact.catalogue.completed`."""

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, given):
        named = isinstance(given, dict) and all(isinstance(name, str) for name in given.values())
        return given | completed(given) if named else given  # the fields refuse what is no name


if TYPE_CHECKING:
    # made below of what the laws declare, which no type checker reads
    LawsSpec: TypeAlias = Any
    LawParameters: TypeAlias = Any


LawsSpec = create_model(  # type: ignore[misc,call-overload]
    "LawsSpec",
    __base__=_Laws,
    __doc__="One law in each slot of the contact.",
    **{slot: (Literal[tuple(laws)], next(iter(laws))) for slot, laws in LAWS.items()},
)


def _parameters():
    """{key: (type, field)} of every parameter of a law; one that several laws share says so."""
    users = {}
    for one in every_law():
        for p in one.parameters:
            users.setdefault(p.key, []).append((one.name, p))
    found = {}
    for key, uses in users.items():
        p, names = uses[0][1], ", ".join(name for name, _ in uses)
        unless = "" if p.default is None else f", {p.default:g} unless given"
        about = f"{names}: {p.meaning}{unless}"
        where = ("", "wall_") if p.wall else ("",)
        for prefix in where:
            partner = f", grain on {'wall' if prefix else 'grain'}" if p.wall else ""
            found[prefix + key] = (float | None, field(None, about + partner, **p.limits))
    return found


LawParameters = create_model(  # type: ignore[misc]
    "LawParameters",
    __base__=Part,  # type: ignore[arg-type]
    __doc__="Constants that the chosen laws need beyond the materials and contacts.",
    **_parameters(),
)


def keys_of(law: Law) -> set[str]:
    """Keys of `law_parameters` that a law has."""
    return {key for group in groups_needed(law) for key in group} | set(keys_allowed(law))


SIZE_COLUMNS = ("diameters_mm", "upper_diameters_mm", "fractions")


class Sizes(Part):
    """A size distribution."""

    by: Literal["number", "mass"] = field("number", "what the fractions are shares of")
    file: str | None = field(None, "table (CSV) in place of the lists: a sieve curve, or sizes")
    diameters_mm: list[Annotated[float, Field(gt=0)]] = Field(min_length=1)
    upper_diameters_mm: list[Annotated[float, Field(gt=0)]] | None = field(
        None, "where given, each class reaches from its diameter to this one"
    )
    fractions: list[Annotated[float, Field(ge=0)]] = Field(min_length=1)


class Clump(Part):
    """A grain of several spheres that overlap or touch and move as one body; one entry a sphere."""

    file: str | None = field(None, "table (CSV) in place of the lists, with them as its columns")
    x_mm: list[float] = Field(min_length=1)
    y_mm: list[float] = Field(min_length=1)
    z_mm: list[float] = Field(min_length=1)
    radius_mm: list[float] = Field(min_length=1)


class Particles(Part):
    """The grains."""

    count: int = field(10000, "number of grains", ge=1, le=5_000_000)
    diameter_mm: float = field(
        2.0,
        "diameter of mono-sized grains; of a clump, that of the sphere of its volume, and that of "
        "its file unless given",
        gt=0,
    )
    sizes: Sizes | None = field(None, "size distribution in place of one diameter")
    scale_factor: float = field(1.0, "multiplies all diameters", gt=0)
    elongation: float = field(
        1.0,
        "length over width; above 1 a grain is two bonded spheres with the volume of one of its "
        "diameter",
        ge=1,
        le=MAX_ELONGATION,
    )
    clump: Clump | None = field(
        None, "shape of a grain of up to ten spheres in place of one; the diameter sets its size"
    )


class Numerics(Part):
    """Numerical choices; they are recorded with each result."""

    rayleigh_fraction: float = field(
        0.4,
        "time step over the Rayleigh time of the smallest grain",
        gt=0,
        le=MAX_RAYLEIGH_FRACTION,
    )
    time_step_s: float | None = field(None, "time step in place of the fraction", gt=0)
    precision: Literal["mixed", "double"] = field("mixed", "float32 forces, or float64 throughout")
    rest_energy_ratio: float = field(
        1e-5, "energy of motion over m g R at which the heap rests", gt=0
    )
    max_time_s: float = field(12.0, "end of the run at the latest (2.2.2: 12 s)", gt=0)
    skin: float = field(0.1, "skin of the pair list over the radius, at rest", gt=0, le=1)
    skin_horizon: int = field(80, "steps of present speed that the skin allows for", ge=1, le=1000)
    overlap_limit: float = field(
        0.3, "overlap over radius that stops a run as blown up", gt=0, le=1
    )


class Output(Part):
    """What a run writes beside its result."""

    frame_interval_s: float | None = field(
        None, "simulated time between VTK frames; none unless given", gt=0
    )
    checkpoint_interval_s: float = field(60.0, "wall time between checkpoints", gt=0)


GEOMETRY = {name: e.geometry for name, e in experiments().items()}
"""Experiment -> schema of its geometry."""


class OtherEngine(Part):
    """Another program that makes the run. Its version and settings are part of what the run is."""

    name: str = field(..., "name of the engine")
    identity: dict = field({}, "version, and digests of the files that its numbers depend on")
    settings: dict = field({}, "what it was told")


class RunSpec(Part):
    """One run."""

    experiment: Literal[tuple(GEOMETRY)]  # type: ignore[valid-type]
    seed: int = field(1, "seed of all random draws", ge=0, lt=2**63)
    materials: Materials = Materials()
    contacts: Contacts = Contacts()
    laws: LawsSpec = LawsSpec()
    law_parameters: LawParameters = LawParameters()
    particles: Particles = Particles()
    geometry: Union[tuple(GEOMETRY.values())]  # type: ignore[valid-type]  # noqa: UP007
    numerics: Numerics = Numerics()
    output: Output = Output()
    engine: OtherEngine | None = field(
        None, "another engine that makes the run; written by a study"
    )


def parse_spec(data: Any, file: str | Path | None = None) -> "RunSpec":
    """`RunSpec` from a mapping. Raises SpecError for the first thing that is wrong."""
    if not isinstance(data, dict):
        raise SpecError("(top level)", data, "a mapping of keys", file)
    try:
        data = converted(data)
    except UnitError as error:
        raise SpecError(error.key, error.value, str(error), file) from None  # type: ignore[attr-defined]
    _expand_tables(data, file)
    kind = data.get("experiment")
    if not isinstance(kind, str) or kind not in GEOMETRY:
        raise SpecError("experiment", kind, ", ".join(GEOMETRY), file)
    try:
        data["geometry"] = GEOMETRY[kind].model_validate(data.get("geometry") or {})  # type: ignore[attr-defined]
    except ValidationError as error:
        raise _first_error(error, file, GEOMETRY[kind], ["geometry"]) from None
    for part, defaults in experiments()[kind].defaults.items():
        given = data.get(part) or {}
        if isinstance(given, dict):
            data[part] = defaults | given
    try:
        spec = RunSpec.model_validate({k: v for k, v in data.items() if v is not None})
    except ValidationError as error:
        raise _first_error(error, file, RunSpec, []) from None
    own = experiment_of(spec).check
    try:
        for check in (_check_laws, _check_sizes, _check_shape, _check_mass, _check_time_step, own):
            check(spec)
    except SpecError as error:
        raise SpecError(error.key, error.value, error.allowed, file) from None
    return spec


def require_material(spec: "RunSpec", file: str | Path | None = None) -> None:
    """Raise SpecError where a spec, as read, leaves a number of the grains' material, size or
    contacts to the schema: what stands there is an example's, and no material is like another.
    Grain on grain counts where grains are poured, and the wall's own material is steel unless
    given."""
    if spec.particles.sizes is None and "diameter_mm" not in spec.particles.model_fields_set:
        raise SpecError("particles.diameter_mm", None, GIVEN, file)
    names = ["materials.particle", "contacts.particle_wall"]
    names += ["contacts.particle_particle"] if experiment_of(spec).poured else []
    for name in names:
        part = attrgetter(name)(spec)
        for key in type(part).model_fields:
            if key not in part.model_fields_set:
                raise SpecError(f"{name}.{key}", None, GIVEN, file)


def load_spec(path: str | Path) -> "RunSpec":
    """`RunSpec` from a YAML file. Raises SpecError; the file's name and the line of the key are
    part of the message."""
    data, lines = read_mapping(path)
    try:
        return parse_spec(data, file=str(path))
    except SpecError as error:
        line = line_of(error.key, lines)
        if line is None:
            raise
        raise SpecError(error.key, error.value, error.allowed, f"{path}, line {line}") from None


def _first_error(error, file, model, prefix):
    first = error.errors()[0]
    kind, key = first["type"], ".".join(map(str, (*prefix, *first["loc"])))
    value = None if kind == "missing" else first.get("input")
    if kind == "extra_forbidden":
        allowed = f"one of the keys {', '.join(_keys_beside(model, first['loc']))}"
    else:
        message = first["msg"][0].lower() + first["msg"][1:]
        allowed = {"missing": GIVEN, "model_type": "a mapping of keys"}.get(kind, message)
    return SpecError(key, value, allowed.removeprefix("input should be "), file)


def _keys_beside(model, loc):
    """Keys that are known where the last part of `loc` was not."""
    for part in loc[:-1]:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        options = [annotation, *getattr(annotation, "__args__", ())]
        model = next(
            (o for o in options if isinstance(o, type) and issubclass(o, BaseModel)), model
        )
    return list(model.model_fields)


def _check_laws(spec):
    given = {k for k, v in spec.law_parameters.model_dump().items() if v is not None}
    chosen = laws_of(spec).chosen()
    for law in chosen:
        for group in groups_needed(law):
            if not given & set(group):
                allowed = f"only with law_parameters.{' or '.join(group)}"
                raise SpecError(f"laws.{law.slot}", law.name, allowed)
    for name in sorted(given.difference(*map(keys_of, chosen))):
        owners = [f"laws.{law.slot}: {law.name}" for law in every_law() if name in keys_of(law)]
        value, allowed = getattr(spec.law_parameters, name), f"only with {' or '.join(owners)}"
        raise SpecError(f"law_parameters.{name}", value, allowed)
    for slot, law, other, name, allowed in laws_of(spec).clashes():
        raise SpecError(f"laws.{other}", name, f"{allowed} where laws.{slot} is {law}")


def _expand_tables(data, file):
    """Put what tables of sizes and spheres say in place of their names: a run is named after the
    numbers, not after a path. A clump has the size of its table where no other is given."""
    sizes = _entry_of_table(data, "sizes", SIZE_COLUMNS, file)
    if sizes:
        read = read_sizes(sizes["file"], sizes.get("by", "number"))
        data["particles"] = data["particles"] | {"sizes": read}
    clump = _entry_of_table(data, "clump", COLUMNS, file)
    if clump:
        particles, own, read = data["particles"], {}, read_clump(clump["file"])
        if particles.get("sizes") is None:
            own["diameter_mm"] = float(f"{2.0 * shape_of(spheres_in(Clump(**read))).scale:.9g}")
        data["particles"] = own | particles | {"clump": read}


def _entry_of_table(data, key, columns, file):
    """The entry of the particles that names a table, None where it names none. Raises SpecError
    where its columns stand beside it."""
    particles = data.get("particles")
    entry = particles.get(key) if isinstance(particles, dict) else None
    if not isinstance(entry, dict) or not isinstance(entry.get("file"), str):
        return None
    for column in columns:
        if entry.get(column) is not None:
            allowed = f"nothing beside particles.{key}.file"
            raise SpecError(f"particles.{key}.{column}", entry[column], allowed, file)
    return entry


def _check_sizes(spec):
    s = spec.particles.sizes
    if s is None:
        return
    if len(s.diameters_mm) != len(s.fractions):
        allowed = f"as many as particles.sizes.diameters_mm ({len(s.diameters_mm)})"
        raise SpecError("particles.sizes.fractions", s.fractions, allowed)
    if not math.isclose(sum(s.fractions), 1.0, abs_tol=1e-6):
        raise SpecError("particles.sizes.fractions", s.fractions, "fractions that sum to 1")
    low, high = classes(s)
    if len(high) != len(low) or (high < low).any():
        allowed = "one for each of particles.sizes.diameters_mm, and none smaller"
        raise SpecError("particles.sizes.upper_diameters_mm", s.upper_diameters_mm, allowed)
    if high.max() > MAX_SIZE_RATIO * low.min():
        allowed = f"a ratio of largest to smallest of at most {MAX_SIZE_RATIO:g}"
        raise SpecError("particles.sizes.diameters_mm", s.diameters_mm, allowed)


def _check_shape(spec):
    p, able = spec.particles, [name for name, e in experiments().items() if e.poured]
    bonds = spec.experiment in able
    if p.elongation != 1.0 and not bonds:
        allowed = f"1 in this experiment; elongated grains are for {', '.join(able)}"
        raise SpecError("particles.elongation", p.elongation, allowed)
    if p.clump is None:
        return
    if not bonds:
        allowed = f"nothing in this experiment; clumps are for {', '.join(able)}"
        raise SpecError("particles.clump", "a clump", allowed)
    if p.elongation != 1.0:
        raise SpecError("particles.elongation", p.elongation, "1 beside particles.clump")
    for column in COLUMNS:
        given, wanted = len(getattr(p.clump, column)), len(p.clump.radius_mm)
        if given != wanted:
            allowed = f"as many values as particles.clump.radius_mm ({wanted})"
            raise SpecError(f"particles.clump.{column}", f"{given} values", allowed)
    wrong = fault(spheres_in(p.clump))
    if wrong:
        raise SpecError(f"particles.clump, sphere {wrong[0] + 1}", *wrong[1:])


def _check_mass(spec):
    """float32 does not hold the product of the masses of two grains that are lighter."""
    mass = _least_mass(spec)
    if spec.numerics.precision == "mixed" and mass < LIGHTEST:
        allowed = f"double where a grain has {mass:.1e} kg; mixed is for {LIGHTEST:g} kg and more"
        raise SpecError("numerics.precision", "mixed", allowed)


def _least_mass(spec):
    """Mass of the smallest sphere [kg]."""
    return sphere.mass(smallest_radius(spec), spec.materials.particle.density_kg_m3)


def _check_time_step(spec):
    """The Rayleigh time limits a step that is given. A law that is stiffer than the elastic contact
    behind it says which step [s] it bears."""
    given, fraction = spec.numerics.time_step_s, spec.numerics.rayleigh_fraction
    rayleigh, mass = rayleigh_of(spec), _least_mass(spec)
    contacts = contact_parameters(spec).values()
    dt = fraction * rayleigh if given is None else given
    limit, limits = MAX_RAYLEIGH_FRACTION * rayleigh, []
    for law in laws_of(spec).chosen():
        if law.longest_step:
            longest = min(law.longest_step(c, mass, limit) for c in contacts)
            limits.append((longest, f" where laws.{law.slot} is {law.name}"))
    if given is not None:
        limits.append((limit, f", {MAX_RAYLEIGH_FRACTION} of the smallest grain's Rayleigh time"))
    for longest, why in limits:
        allowed = f"at most {longest:.4g} s{why}"
        if dt > longest and given is not None:
            raise SpecError("numerics.time_step_s", dt, allowed)
        if dt > longest:
            allowed = f"at most {fraction * longest / dt:.4g}, a time step of {allowed}"
            raise SpecError("numerics.rayleigh_fraction", fraction, allowed)


def canonical(spec: "RunSpec") -> str:
    """Canonical JSON of what determines the run's result: not `output`; of a mesh the content, not
    the path; whether meshes may be open only where there is one."""
    data = spec.model_dump(mode="json", exclude={"output"})
    geometry = data["geometry"]
    if spec.particles.clump is None:  # spheres have the name that they had before clumps
        data["particles"].pop("clump")
    if spec.engine is None:
        data.pop("engine")
    else:  # how long one waits for a result does not change it
        data["engine"]["settings"].pop("timeout_s", None)
    named = input_digests(spec)
    geometry |= {key: digest for key, digest in named.items() if digest}
    if not named:
        geometry.pop("meshes", None)
    # an experiment of the package is part of the engine, which has a fingerprint of its own
    outside = source_outside(spec.experiment)
    if outside is not None:
        data["experiment_source"] = digest_of(outside)
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def input_digests(spec: "RunSpec") -> dict[str, str | None]:
    """{key of the geometry: SHA-256 of the file that it names, None where there is no such
    file}."""
    return {
        key: digest_of(path) if Path(path).is_file() else None
        for key, path in spec.geometry.model_dump(mode="json").items()
        if key.endswith("_stl") and path is not None
    }


def content_hash(spec: "RunSpec") -> str:
    """First 16 hex digits of the SHA-256 of `canonical`."""
    return hashlib.sha256(canonical(spec).encode()).hexdigest()[:16]
