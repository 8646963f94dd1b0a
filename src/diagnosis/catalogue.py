"""The catalogue of mechanisms: `mechanisms.csv` says what each is, APPLY and OBSERVE what it does.

A study may add a folder of its own (`diagnosis.catalogue`), each file of which defines one
`MECHANISM`.

A mechanism of the engine has `apply(spec, strength)`, which returns a run spec with its law
switched on. A mechanism of the measurement also has `observe(value, condition, strength)`: what
would have been read in place of the true value (arrays or floats; condition is the mapping of
levers). Its `apply` uses the engine's own model of the instrument and makes test data.
"""

import csv
import importlib.util
import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import ConfigError
from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS
from dem.experiments import experiments
from dem.spec import keys_of

FACTS = Path(__file__).with_name("mechanisms.csv")


@dataclass(frozen=True)
class Strength:
    """The one number that says how strong a mechanism is, with its range in `unit`.

    `off` is where it is weakest, `low` unless given.
    """

    name: str
    unit: str
    low: float
    high: float
    _: KW_ONLY
    log: bool = False
    off: float | None = None

    def natural(self, coded: Any) -> Any:
        """Strength in its unit from a coded one in [0, 1]."""
        if self.log:
            return self.low * (self.high / self.low) ** coded
        return self.low + coded * (self.high - self.low)

    def coded(self, natural: float) -> float:
        """Coded strength in [0, 1] from one in its unit."""
        if self.log:
            return math.log(natural / self.low) / math.log(self.high / self.low)
        return (natural - self.low) / (self.high - self.low)

    def slope(self, coded: Any) -> Any:
        """Derivative of `natural`."""
        if self.log:
            return self.natural(coded) * math.log(self.high / self.low)
        return self.high - self.low + 0.0 * coded

    @property
    def weakest(self) -> float:
        """Coded strength at which it is weakest."""
        return self.coded(self.low if self.off is None else self.off)


@dataclass(frozen=True)
class Mechanism:
    """One thing that a model may be missing.

    multiplies: a lever, if the mechanism is the base model with that lever times the strength and
    nothing else. law: (slot, state) of the free law (`diagnosis.laws`) that it is a case of.
    changes: key of the coefficient and the lever along which it changes, of a free law of bulk
    tests.
    """

    name: str
    description: str
    source: str
    experiments: tuple
    levers: tuple
    strength: Strength
    apply: Callable
    observe: Callable | None = None
    multiplies: str | None = None
    law: tuple | None = None
    changes: tuple | None = None


def set_law(spec: dict[str, Any], slot: str, law: str, **parameters: float) -> dict[str, Any]:
    """Run spec (a mapping) with one law chosen and its parameters set, without those of the law
    that it replaces; the given one is left as it was."""
    before = LAWS[slot].get(spec.get("laws", {}).get(slot))
    gone = keys_of(before) - keys_of(LAWS[slot][law]) if before else ()
    kept = {k: v for k, v in spec.get("law_parameters", {}).items() if k not in gone}
    return spec | {
        "laws": spec.get("laws", {}) | {slot: law},
        "law_parameters": kept | parameters,
    }


def set_part(spec: dict[str, Any], part: str, **values: Any) -> dict[str, Any]:
    """Run spec (a mapping) with values of one of its parts set; the given one is left as it was."""
    return spec | {part: spec.get(part, {}) | values}


def coarse(spec: Mapping[str, Any]) -> float:
    """Factor by which the grains of a run spec (a mapping) are coarser than those that they stand
    for.

    A force that is proportional to the radius is multiplied by it. Force over area is then that of
    the finer grains, and so is the ratio of cohesion to the weight of a heap in the same rig.
    """
    return spec.get("particles", {}).get("scale_factor", 1.0)


# --- what each does to a run --------------------------------------------------------------------


def air_drag(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Schiller-Naumann drag of a gas `strength` times as dense and viscous as air."""
    strength = max(strength, 1e-6)
    gas = {"air_density_kg_m3": 1.2 * strength, "air_viscosity_Pa_s": 1.8e-5 * strength}
    return set_law(spec, "drag", "schiller_naumann", **gas)


def apex_sampling(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Heights at frames only; the frame interval is the stated one times the strength."""
    stated = spec["geometry"].get("output_interval_s")
    if not stated or strength <= 0.0:
        return spec
    return set_part(spec, "geometry", output_interval_s=stated * strength)


def cohesion(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """JKR adhesion between grains with one surface energy; the walls do not attract. Coarse grains
    get more, so that the tensile stress is kept."""
    return set_law(spec, "cohesion", "jkr", surface_energy_J_m2=strength * coarse(spec))


def grain_shape(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Each grain is two bonded spheres with the volume of the stated one; the strength is length
    over width. Longer grains than those of the range do not pass the funnel that stands in the rig
    for coarse spheres."""
    return set_part(spec, "particles", elongation=strength)


def liquid_bridge(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Capillary bridges of a fixed volume; the strength is the surface tension times the wetting.

    Coarse grains get more of it, so that the tensile stress is kept. The plate of the drop test is
    wet too: there a wet grain is told from a dry one (Gollwitzer, Rehberg, Kruelle, Huang (2012),
    Phys. Rev. E 86:011303). The funnel and the shear cell stay dry, since grains that stick to a
    funnel do not leave it.
    """
    liquid = {"liquid_volume_fraction": 0.005}
    if spec["experiment"] == "drop":
        liquid["wall_liquid_volume_fraction"] = 0.005
    tension = max(strength * coarse(spec), 1e-9)
    return set_law(spec, "cohesion", "liquid_bridge", surface_tension_N_m=tension, **liquid)


def rolling_law(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Elastic-plastic rolling resistance (type C) in place of a constant torque (type A); the
    strength is the rolling stiffness in units of the contact's.

    With torsion, or grains that spin about the normal of their contact would keep a heap from rest.
    """
    twisting = set_law(spec, "torsion", "marshall")
    return set_law(twisting, "rolling", "elastic_plastic", rolling_stiffness_factor=strength)


def size_bias(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """All diameters multiplied, the number of grains kept."""
    return set_part(spec, "particles", scale_factor=coarse(spec) * strength)


def stress_dependent_friction(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """mu = mu0 (F / F0)^-n; F0 is about the weight of a 2 mm grain of salt."""
    powers = {"friction_exponent": strength, "friction_reference_force_N": 5e-5}
    return set_law(spec, "friction", "stress_dependent", **powers)


def tilt_detection_lag(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """Sliding counts only after this much movement."""
    return set_part(spec, "geometry", slip_mm=max(strength, spec["geometry"]["slip_mm"]))


def uncounted_load(spec: dict[str, Any], strength: float) -> dict[str, Any]:
    """The test runs under the stated normal stress and `strength` kPa more."""
    normal = spec["geometry"]["normal_stress_kPa"] + strength
    return set_part(spec, "geometry", normal_stress_kPa=normal)


def _law(slot, law, parameter):
    """`apply` of a law of the engine with one parameter, the strength."""
    return lambda spec, strength: set_law(spec, slot, law, **{parameter: strength})


APPLY = {
    f.__name__: f
    for f in (
        air_drag, apex_sampling, cohesion, grain_shape, liquid_bridge, rolling_law, size_bias,
        stress_dependent_friction, tilt_detection_lag, uncounted_load,
    )
} | {
    # elastic-plastic: the restitution of the base model holds below the yield speed
    "plastic_restitution": _law("damping", "plastic", "yield_velocity_m_s"),
    # in place of the dashpot with a constant restitution
    "viscoelastic_restitution": _law("damping", "viscoelastic", "viscoelastic_time_s"),
    # JKR between grain and wall; grains do not attract each other
    "wall_adhesion": _law("cohesion", "jkr", "wall_surface_energy_J_m2"),
}  # fmt: skip


# --- what is read in place of the true value ------------------------------------------------------


def _at_frames(value, condition, strength):
    """Rebound [mm] as read: less the mean deficit g dt^2 / 24 of an apex at a random phase between
    frames."""
    interval = strength * condition.get("output_interval_s", 0.0)
    return np.maximum(value - 1e3 * GRAVITY * interval * interval / 24.0, 1e-3)


def _seen_late(value, condition, strength):
    """Angle [deg] read `strength` mm after the start of sliding, while the plate goes on
    turning."""
    rate = math.radians(condition.get("tilt_rate_deg_s", 5.0))
    slip = 1e-3 * np.maximum(strength, 0.0)
    cosine = np.cos(np.radians(np.minimum(value, 89.0)))
    return value + np.degrees(rate * np.cbrt(6.0 * slip * cosine / (GRAVITY * rate)))


def _under_more(value, condition, strength):
    """Shear stress [kPa] as read under `strength` kPa more than stated, of a yield locus through
    the origin."""
    stated = condition["normal_stress_kPa"]
    return value * (stated + strength) / stated


OBSERVE = {
    "apex_sampling": _at_frames,
    "tilt_detection_lag": _seen_late,
    "uncounted_load": _under_more,
}


def load_catalogue(folder: str | Path | None = None) -> dict[str, Mechanism]:
    """{name: Mechanism} of the table and of every file in `folder`.

    Raises ConfigError for a folder that is not there and for a file that defines no new mechanism.
    """
    with FACTS.open(encoding="utf-8", newline="") as rows:
        found = {row["name"]: _shipped(row) for row in csv.DictReader(rows)}
    if folder is not None and not Path(folder).is_dir():
        raise ConfigError("is no folder", path=folder, key="diagnosis.catalogue")
    for path in sorted(Path(folder).glob("[!_]*.py")) if folder is not None else ():
        mechanism = _mechanism_of(path)
        if mechanism.name in found:
            allowed = f"another than {', '.join(found)}"
            raise ConfigError(
                "is taken", path=path, key="name", value=mechanism.name, allowed=allowed
            )
        found[mechanism.name] = mechanism
    return {name: _where_it_shows(m) for name, m in found.items()}


def _shipped(row):
    """`Mechanism` of a row of the table."""
    name, off = row["name"], row["off"]
    low, high = float(row["low"]), float(row["high"])
    return Mechanism(
        name=name,
        description=row["description"],
        source=row["source"],
        experiments=tuple(row["experiments"].split()),
        levers=tuple(row["levers"].split()),
        strength=Strength(
            row["strength"], row["unit"], low, high,
            log=row["log"] == "yes", off=float(off) if off else None,
        ),
        apply=APPLY[name],
        observe=OBSERVE.get(name),
        multiplies=row["multiplies"] or None,
        law=(row["slot"], tuple(row["state"].split())) if row["slot"] else None,
    )  # fmt: skip


def _where_it_shows(mechanism):
    """The mechanism with the experiments that name it beside those that it names itself."""
    more = [
        name
        for name, e in experiments().items()
        if mechanism.name in e.mechanisms and name not in mechanism.experiments
    ]
    return replace(mechanism, experiments=(*mechanism.experiments, *more)) if more else mechanism


def _mechanism_of(path):
    spec = importlib.util.spec_from_file_location(f"mechanism_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the file is the user's
        raise ConfigError(f"cannot be loaded ({error})", path=path) from error
    mechanism = getattr(module, "MECHANISM", None)
    if not isinstance(mechanism, Mechanism):
        raise ConfigError("defines no mechanism", path=path, allowed="MECHANISM = Mechanism(...)")
    return mechanism
