"""How many grains a rig takes, how fast its funnel feeds them, and what that costs to compute."""

import math
from dataclasses import dataclass, replace

from dem.experiments.heap import PACKING
from dem.flow import C_BEVERLOO, FREE_FLOW_RATIO, K_BEVERLOO, beverloo
from dem.timescales import rayleigh_time

SPILL = 1.3  # grains poured over grains of a full cone: some roll off
MOST = 10_000
FEWEST = 300
FEED = 0.65
"""Share of the orifice's capacity at which grains are made. From 70 % on a funnel packs in some
runs and not in others, and the angles come in two kinds."""
SETTLING = 1.5  # s after the last grain has left the funnel


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

    @property
    def count(self):
        """Grains that a cone of the measured angle over the whole plate takes, and what rolls
        off."""
        radius = 0.5 * self.plate_diameter_mm
        cone = math.pi / 3 * radius**3 * math.tan(math.radians(self.angle_deg))
        grain = math.pi / 6 * self.diameter_mm**3
        return max(round(SPILL * PACKING * cone / grain), FEWEST)

    @property
    def capacity_per_s(self):
        """Grains that the orifice passes in a second (Beverloo 1961)."""
        d = 1e-3 * self.diameter_mm
        opening = max(1e-3 * self.orifice_diameter_mm, (K_BEVERLOO + 0.1) * d)
        return C_BEVERLOO * beverloo(PACKING, opening, d) / (math.pi / 6 * d**3)

    @property
    def feed_per_s(self):
        """Grains made in a second: as was measured, else FEED of what the orifice passes."""
        if self.mass_flow_g_s is None:
            return FEED * self.capacity_per_s
        grain_g = 1e3 * self.density_kg_m3 * math.pi / 6 * (1e-3 * self.diameter_mm) ** 3
        return self.mass_flow_g_s / grain_g

    @property
    def feed_share(self):
        """The feed over what the orifice passes."""
        return self.feed_per_s / self.capacity_per_s

    @property
    def pouring_s(self):
        """Time [s] during which grains are made."""
        return self.count / self.feed_per_s

    @property
    def particle_steps(self):
        """Work of one heap: grains times steps of 0.4 Rayleigh times."""
        step = 0.4 * rayleigh_time(
            0.5e-3 * self.diameter_mm, self.density_kg_m3, self.shear_modulus_Pa, self.poisson_ratio
        )
        return self.count * (self.pouring_s + SETTLING) / step

    def of_at_most(self, most):
        """The same heap of fewer, larger grains; an orifice of FREE_FLOW_RATIO grains stays so."""
        if self.count <= most:
            return self
        wanted = self.diameter_mm * (self.count / most) ** (1 / 3)
        passing = max(self.orifice_diameter_mm / FREE_FLOW_RATIO, self.diameter_mm)
        return replace(self, diameter_mm=round(min(wanted, passing), 4))
