"""The mechanisms of the package, each with its law of the engine or its way of reading."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from calibration.study.config import overlay
from dem.constants import GRAVITY
from diagnosis.catalogue import Mechanism, Strength, coarse, set_law

AIR = {"air_density_kg_m3": 1.2, "air_viscosity_Pa_s": 1.8e-5}
TILT_RATE = 5.0  # where a table has no rate
BRIDGE = 0.005  # volume of a liquid bridge over that of a grain
HEAVY = 5e-5  # N, about the weight of a 2 mm grain of salt
LONGEST = 1.6  # longer grains do not pass the funnel that stands in the rig for coarse spheres


def _setting(slot: str, law: str, key: str, **fixed: float) -> Callable[..., dict[str, Any]]:
    """`apply` of a law of the engine with one parameter that is the strength."""
    return lambda spec, strength: set_law(spec, slot, law, **{key: strength}, **fixed)


def _air_drag(spec, strength):
    """Schiller-Naumann drag of a gas `strength` times as dense and viscous as air."""
    gas = {key: value * max(strength, 1e-6) for key, value in AIR.items()}
    return set_law(spec, "drag", "schiller_naumann", **gas)


def _read_at_frames(value, condition, strength):
    """Rebound [mm] as read: less the mean deficit g dt^2 / 24 of an apex at a random phase between
    frames."""
    interval = strength * condition.get("output_interval_s", 0.0)
    return np.maximum(value - 1e3 * GRAVITY * interval * interval / 24.0, 1e-3)


def _cohesion(spec, strength):
    """JKR between grains; the walls do not attract. Coarse grains get more, so that the tensile
    stress is kept."""
    return set_law(spec, "cohesion", "jkr", surface_energy_J_m2=strength * coarse(spec))


def _liquid_bridge(spec, strength):
    """Bridges of a fixed volume; the strength is the surface tension times the wetting.

    Coarse grains get more of it, so that the tensile stress is kept. The plate of the drop test is
    wet too: there a wet grain is told from a dry one (Gollwitzer, Rehberg, Kruelle, Huang (2012),
    Phys. Rev. E 86:011303). The funnel and the shear cell stay dry, since grains that stick to a
    funnel do not leave it.
    """
    wet_plate = {"wall_liquid_volume_fraction": BRIDGE} if spec["experiment"] == "drop" else {}
    tension = max(strength * coarse(spec), 1e-9)
    wet = {"surface_tension_N_m": tension, "liquid_volume_fraction": BRIDGE}
    return set_law(spec, "cohesion", "liquid_bridge", **wet, **wet_plate)


def _rolling_law(spec, strength):
    """Type C in place of type A; the strength is the rolling stiffness in units of the contact's.

    With torsion, or grains that spin about the normal of their contact would keep a heap from rest.
    """
    twisting = set_law(spec, "torsion", "marshall")
    return set_law(twisting, "rolling", "elastic_plastic", rolling_stiffness_factor=strength)


def _read_late(value, condition, strength):
    """Angle [deg] read `strength` mm after the start of sliding, while the plate goes on
    turning."""
    rate = math.radians(condition.get("tilt_rate_deg_s", TILT_RATE))
    slip = 1e-3 * np.maximum(strength, 0.0)
    cosine = np.cos(np.radians(np.minimum(value, 89.0)))
    return value + np.degrees(rate * np.cbrt(6.0 * slip * cosine / (GRAVITY * rate)))


def _read_loaded(value, condition, strength):
    """Shear stress [kPa] as read under `strength` kPa more than stated, of a yield locus through
    the origin."""
    stated = condition["normal_stress_kPa"]
    return value * (stated + strength) / stated


MECHANISMS = (
    Mechanism(
        name="air_drag",
        description="air slows small grains in long drops, which looks like a restitution that "
        "falls with speed",
        source="Schiller, Naumann (1933), Zeitschrift des VDI 77:318",
        experiments=("drop",),
        strength=Strength("drag over that of air", "1", 0.0, 2.0),
        apply=_air_drag,
        law=("drag", ("speed", "size")),
    ),
    Mechanism(
        name="apex_sampling",
        description="the apex lies between two frames; the rebound reads low by g dt^2 / 24 on "
        "average",
        source="mean over a uniform phase of the parabola's deficit, at most g dt^2 / 8",
        experiments=("drop",),
        strength=Strength("frame interval over the stated one", "1", 0.0, 2.0),
        observe=_read_at_frames,
        law=("reading", ("interval",)),
    ),
    Mechanism(
        name="cohesion",
        description="grains attract each other; the yield locus gains an intercept and small "
        "grains stand steeper",
        source="Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301",
        experiments=("shear", "heap"),
        strength=Strength("surface energy", "J/m2", 0.0, 0.12),
        apply=_cohesion,
        law=("attraction", ()),
    ),
    Mechanism(
        name="grain_shape",
        description="elongated grains roll less than spheres do; a heap that rolling friction "
        "hardly holds stands steeper",
        source="Wensrich, Katterfeld (2012), Powder Technol. 217:409",
        experiments=("heap",),
        strength=Strength("length over width", "1", 1.0, LONGEST, off=1.0),
        # two bonded spheres with the volume of the stated one
        apply=lambda spec, s: overlay(spec, {"particles": {"elongation": s}}),
    ),
    Mechanism(
        name="liquid_bridge",
        description="water bridges hold grains together and slow their rebound; small grains "
        "stand steeper, bounce lower",
        source="Willett, Adams, Johnson, Seville (2000), Langmuir 16:9396",
        experiments=("shear", "heap", "drop"),
        strength=Strength("surface tension", "N/m", 0.0, 0.073),
        apply=_liquid_bridge,
        law=("attraction", ("size",)),
    ),
    Mechanism(
        name="plastic_restitution",
        description="restitution falls as the inverse fourth root of speed, above the speed at "
        "which the contact yields",
        source="Thornton (1997), J. Appl. Mech. 64:383",
        experiments=("drop",),
        strength=Strength("yield speed", "m/s", 0.1, 4.0, log=True, off=4.0),
        # the restitution of the base model holds below the yield speed
        apply=_setting("damping", "plastic", "yield_velocity_m_s"),
        law=("restitution", ("speed",)),
    ),
    Mechanism(
        name="rolling_law",
        description="grains at rest are held by a rolling spring, as angular ones are; a constant "
        "torque lets them creep",
        source="Ai, Chen, Rotter, Ooi (2011), Powder Technol. 206:269",
        experiments=("heap", "shear"),
        strength=Strength("rolling stiffness factor", "1", 0.5, 4.0, log=True),
        apply=_rolling_law,
    ),
    Mechanism(
        name="size_bias",
        description="the stated diameter is off by a factor; shows where the rig is small against "
        "the grains",
        source="sieving passes grains by their second largest dimension",
        experiments=("heap",),
        strength=Strength("true over stated diameter", "1", 0.75, 1.3, off=1.0),
        # the number of grains is kept
        apply=lambda spec, s: overlay(spec, {"particles": {"scale_factor": coarse(spec) * s}}),
    ),
    Mechanism(
        name="stress_dependent_friction",
        description="friction falls as a power of the load; the yield locus is curved and small "
        "grains slide later",
        source="Archard (1957), Proc. R. Soc. A 243:190",
        experiments=("tilt", "shear"),
        strength=Strength("exponent", "1", 0.0, 1 / 3),
        # mu = mu0 (F / F0)^-n
        apply=_setting(
            "friction", "stress_dependent", "friction_exponent", friction_reference_force_N=HEAVY
        ),
        law=("friction", ("size",)),
    ),
    Mechanism(
        name="tilt_detection_lag",
        description="the plate turns on before sliding is seen; the excess grows as the tilt rate "
        "to the power 2/3",
        source="uniform acceleration g cos(theta) w t of a grain on a plate turning at w: slip g "
        "cos(theta) w t^3 / 6",
        experiments=("tilt",),
        strength=Strength("slip when seen", "mm", 0.0, 4.0),
        observe=_read_late,
        law=("reading", ("rate",)),
    ),
    Mechanism(
        name="uncounted_load",
        description="weight of lid, ring and grains above the shear plane is missing in the "
        "normal stress; it looks like cohesion, but shows in the shear test alone",
        source="ASTM D6128 counts the weight of everything above the shear plane into the normal "
        "stress",
        experiments=("shear",),
        strength=Strength("load not counted", "kPa", 0.0, 0.3),
        observe=_read_loaded,
        law=("load", ()),
    ),
    Mechanism(
        name="viscoelastic_restitution",
        description="restitution falls with impact speed, 1 - e growing as its fifth root",
        source="Brilliantov, Spahn, Hertzsch, Poeschel (1996), Phys. Rev. E 53:5382",
        experiments=("drop",),
        strength=Strength("dissipation time", "s", 2e-6, 4e-5, log=True),
        # in place of a dashpot with a constant restitution
        apply=_setting("damping", "viscoelastic", "viscoelastic_time_s"),
        law=("restitution", ("speed",)),
    ),
    Mechanism(
        name="wall_adhesion",
        description="grains stick to the plate; small ones slide later by the inverse square of "
        "their diameter",
        source="Johnson, Kendall, Roberts (1971), Proc. R. Soc. A 324:301",
        experiments=("tilt", "drop"),
        strength=Strength("wall surface energy", "J/m2", 0.0, 2e-4),
        # grains do not attract each other
        apply=_setting("cohesion", "jkr", "wall_surface_energy_J_m2"),
        law=("attraction", ("size",)),
    ),
)
