"""How many grains a rig takes, how fast its funnel feeds them, and what that costs to compute."""

import math
from dataclasses import dataclass, replace

from calibration.study.config.schema import COARSER
from dem.advice import bed_pressure, pressed_step
from dem.constants import GRAVITY
from dem.contact.registry import ContactParameters, Laws, Material
from dem.experiments.heap import PACKING, solid_rate
from dem.flow import FREE_FLOW_RATIO, K_BEVERLOO
from dem.timescales import hertz_contact_time, rayleigh_time

SPILL = 1.3  # grains poured over grains of a full cone: some roll off
MOST = 10_000
FEWEST = 300
FEED = 0.65
"""Share at which grains are made of what the orifice passes of the quick profile's larger grains.
From 70 % on a funnel packs in some runs and not in others, and the angles come in two kinds."""
RAYLEIGH = 0.4  # Rayleigh times in a time step, at most
IMPACT_STEPS = 5.5  # that an impact on the plate lasts at least; the engine warns below 5
ROOM = 5.0  # deg by which a heap may be steeper than the measured one and not touch the orifice
QUICK_WIDER = COARSER["quick"] ** (1 / 3)  # grains of the quick profile, times as wide
STEEL = Material(7800.0, 8.0e10, 0.3)


def cone_height(plate_mm: float, angle_deg: float) -> float:
    """Height [mm] of a cone of the angle over the whole plate."""
    return 0.5 * plate_mm * math.tan(math.radians(angle_deg))


def roomy_height(plate_mm: float, rim_mm: float, angle_deg: float) -> int:
    """Lowest orifice [mm] that a heap by ROOM steeper than the angle does not touch; it stands on
    the rim."""
    return math.ceil(rim_mm + cone_height(plate_mm, angle_deg + ROOM))


def steady_fraction(
    most: float, radius: float, material: Material, pressure: float, restitution: float,
    longest: float = math.inf,
) -> float:  # fmt: skip
    """Rayleigh times in a time step, `most` or fewer, at which grains under a pressure [Pa] come to
    rest; longest: a step [s] that it may have as well. radius: of the smallest grain [m]."""
    contact = ContactParameters(restitution, 0.0)
    step = min(pressed_step(radius, material, contact, pressure, Laws()), longest)
    m = material
    rayleigh = rayleigh_time(radius, m.density, m.shear_modulus, m.poisson_ratio)
    return min(most, math.floor(100 * step / rayleigh) / 100)


@dataclass(frozen=True)
class Heap:
    """A funnel pour; lengths [mm], density of the grain [kg/m3], modulus [Pa], angle [deg]."""

    diameter_mm: float
    density_kg_m3: float
    orifice_diameter_mm: float
    plate_diameter_mm: float
    discharge_height_mm: float
    angle_deg: float
    shear_modulus_Pa: float
    poisson_ratio: float = 0.25
    mass_flow_g_s: float | None = None  # poured in a second, where the laboratory measured it
    plate_rim_height_mm: float = 0.0
    least_restitution: float = 0.2  # between grains, of those that are tried

    @property
    def apex_mm(self) -> float:
        """Height [mm] above the plate of a full cone of the measured angle, which stands on the
        rim."""
        return self.plate_rim_height_mm + cone_height(self.plate_diameter_mm, self.angle_deg)

    @property
    def count(self) -> int:
        """Grains that a cone of the measured angle over the whole plate takes, with the bed inside
        the rim, and what rolls off."""
        area = math.pi / 4 * self.plate_diameter_mm**2
        cone = area * cone_height(self.plate_diameter_mm, self.angle_deg) / 3
        grain = math.pi / 6 * self.diameter_mm**3
        heap = cone + area * self.plate_rim_height_mm
        return max(round(SPILL * PACKING * heap / grain), FEWEST)

    @property
    def capacity_per_s(self) -> float:
        """Grains that the orifice passes in a second (Beverloo 1961)."""
        return self._passes(1e-3 * self.diameter_mm) / self._grain

    @property
    def _grain(self):
        """Volume [m3] of a grain."""
        return math.pi / 6 * (1e-3 * self.diameter_mm) ** 3

    def _passes(self, d):
        """Solid volume [m3/s] of grains of `d` [m] that the orifice passes."""
        opening = max(1e-3 * self.orifice_diameter_mm, (K_BEVERLOO + 0.1) * d)
        return solid_rate(opening, d)

    @property
    def feed_per_s(self) -> float:
        """Grains made in a second: as was measured, else FEED of what the orifice passes of the
        quick profile's grains, so that the same mass in a second passes in that profile too."""
        if self.mass_flow_g_s is None:
            own = 1e-3 * self.diameter_mm
            passes = min(self._passes(own), self._passes(own * QUICK_WIDER))
            return FEED * passes / self._grain
        return self.mass_flow_g_s / (1e3 * self.density_kg_m3 * self._grain)

    @property
    def feed_share(self) -> float:
        """The feed over what the orifice passes."""
        return self.feed_per_s / self.capacity_per_s

    @property
    def rayleigh_fraction(self) -> float:
        """Rayleigh times in a time step: RAYLEIGH, or fewer where an impact on the plate would last
        less than IMPACT_STEPS or pressed grains would tremble."""
        radius = 0.5e-3 * self.diameter_mm
        material = Material(self.density_kg_m3, self.shear_modulus_Pa, self.poisson_ratio)
        speed = math.sqrt(2.0 * GRAVITY * 1e-3 * self.discharge_height_mm)
        impact = hertz_contact_time(radius, speed, material, STEEL) / IMPACT_STEPS
        pressure = bed_pressure(self.count, 2.0 * radius, self.density_kg_m3)
        return steady_fraction(RAYLEIGH, radius, material, pressure, self.least_restitution, impact)

    def of_at_most(self, most: int) -> "Heap":
        """The same heap of fewer, larger grains; an orifice of FREE_FLOW_RATIO grains stays so."""
        if self.count <= most:
            return self
        wanted = self.diameter_mm * (self.count / most) ** (1 / 3)
        passing = max(self.orifice_diameter_mm / FREE_FLOW_RATIO, self.diameter_mm)
        return replace(self, diameter_mm=round(min(wanted, passing), 4))
