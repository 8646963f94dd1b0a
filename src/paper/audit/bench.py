"""Tables 8 and 9, the yield locus and the time steps: bench tests, their fits (Eq. 21, 23, 26) and
inverses, and what too few steps in a contact do to Table 9."""

from dataclasses import dataclass

import numpy as np

from dem.contact.registry import Material
from dem.timescales import hertz_contact_time, rayleigh_time
from paper.audit.materials import SIEVES_MM, intrinsic
from paper.audit.paper import Cells, Claims, Found, Paper, Printed, propagate

# Hertz: duration = 2.9432 x peak overlap / speed (Johnson, Contact Mechanics, 1985, 11.4).
DURATION_OVER_OVERLAP_TIME = 2.9432
FEW_STEPS = (3.0, 3.5, 4.0)


@dataclass(frozen=True)
class Sweep:
    """A bench test's simulated sweep: where its parameter, response, fit and measured value
    stand."""

    table: str
    parameter: str
    response: str
    equation: str
    measured: str
    confirmed: str
    unit: str

    def points(self, paper: Paper) -> tuple[np.ndarray, np.ndarray]:
        """Parameter (n,) and response (n,) of the table."""
        table = paper.numbers(self.table, self.parameter, self.response)
        return table[self.parameter].to_numpy(), table[self.response].to_numpy()

    def curve(self, paper: Paper) -> list[Printed]:
        """The printed quadratic's coefficients, highest power first."""
        texts = paper.scalar_text(f"{self.equation}_coefficients").split()
        return [p for p in map(Printed.parse, texts) if p is not None]


TILT = Sweep(
    "table08_inclined_plane", "salt_steel_static_friction", "angle_deg", "eq21",
    "measured_inclined_plane_angle", "simulated_tilt_angle", "deg",
)  # fmt: skip
DROP = Sweep(
    "table09_drop_test", "salt_steel_restitution", "rebound_height_mm", "eq23",
    "measured_rebound_height", "simulated_rebound_at_0.421", "mm",
)  # fmt: skip
SWEEPS = {"table08": TILT, "tilt": TILT, "table09": DROP, "drop": DROP}
"""First part of a claim's id: sweep."""


def r_squared(y: np.ndarray, predicted: np.ndarray) -> float:
    """1 - residual over total sum of squares, of any curve."""
    return float(1 - np.sum((y - predicted) ** 2) / np.sum((y - y.mean()) ** 2))


def inverse_quadratic(curve: np.ndarray, y: float, low: float, high: float) -> float:
    """The x where the quadratic (highest power first) is y: the root nearest the middle of
    low..high; nan if none."""
    roots = np.roots(np.asarray(curve, float) - [0.0, 0.0, y])
    real = roots[np.isreal(roots)].real
    return float(real[np.argmin(np.abs(real - (low + high) / 2))]) if len(real) else float("nan")


def _readings(name):
    """Mean of readings_<name>.csv, None where the paper does not print them and no such file was
    added."""
    file = f"readings_{name}"
    return lambda paper, _: paper.numbers(file, "value").value.mean() if paper.has(file) else None


def _points(paper, claim):
    return SWEEPS[claim.group].points(paper)


def _end(of):
    return lambda paper, claim: Found(of(_points(paper, claim)[0]), exact=True)


def _increment(paper, claim):
    steps = np.diff(_points(paper, claim)[0])
    even = np.ptp(steps) < 1e-9
    return Found(np.median(steps), exact=True, holds=None if even else False)


def _implied_count(paper, claim):
    ends = (f"{claim.group}.{end}" for end in ("low", "high", "step"))
    low, high, step = (paper.claims[end].value for end in ends)
    return round((high - low) / step) + 1


def coefficients(paper: Paper) -> Cells:
    """The printed coefficients of Eqs. 21 and 23."""
    for sweep in (TILT, DROP):
        x, y = sweep.points(paper)
        printed = sweep.curve(paper)
        deviation = np.abs(np.polyval([p.value for p in printed], x) - y).max()
        where = f"Eq. {sweep.equation[2:]}"
        for power, value, cell in zip((2, 1, 0), np.polyfit(x, y, 2), printed, strict=True):
            names = {"equation": sweep.equation, "power": power, "unit": sweep.unit}
            names |= {"where": where, "deviation": deviation}
            yield "{equation}.c{power}", cell.text, Found(value, names=names)


def _fit_r2(paper, claim):
    x, y = _points(paper, claim)
    printed = [p.value for p in SWEEPS[claim.group].curve(paper)]
    best, curve = (r_squared(y, np.polyval(c, x)) for c in (np.polyfit(x, y, 2), printed))
    return Found(best, names={"curve": curve})


def _inverse_of_print(paper, claim):
    sweep = SWEEPS[claim.group]
    x, _ = sweep.points(paper)
    measured = paper.value(sweep.measured)  # it was put into the equation, and counts as exact

    def inverse(curve):
        return inverse_quadratic(curve, measured, x.min(), x.max())

    printed = sweep.curve(paper)
    return Found(inverse([p.value for p in printed]), half_width=propagate(inverse, printed))


def _inverse_of_fit(paper, claim):
    x, y = _points(paper, claim)
    measured = paper.value(SWEEPS[claim.group].measured)
    return inverse_quadratic(np.polyfit(x, y, 2), measured, x.min(), x.max())


def _direct_tilt(paper, claim):
    value = np.tan(np.radians(paper.value(TILT.measured)))
    return Found(value, names={"law": "tan(angle)"})


def _direct_drop(paper, claim):
    value = np.sqrt(paper.value(DROP.measured) / paper.value("drop_height"))
    return Found(value, names={"law": "sqrt(h/H)"})


def _confirmation_error(paper, claim):
    sweep = SWEEPS[claim.group]
    measured = paper.value(sweep.measured)
    return 100 * abs(paper.value(sweep.confirmed) - measured) / measured


def _between(paper, claim):
    x, y = _points(paper, claim)
    at = paper.value(SWEEPS[claim.group].parameter)
    low, high = y[x <= at].max(initial=-np.inf), y[x >= at].min(initial=np.inf)
    return Found(f"{low:g} to {high:g}", holds=low <= claim.value <= high, names={"at": at})


def _tilt_reach(paper, claim):
    angles = TILT.points(paper)[1]
    needed = paper.value("tilt_start") + angles.max() / paper.value("inclined_plane_tilt_rate")
    return Found(needed, holds=claim.value >= needed)


def _drop_duration(paper, claim):
    """Fall, then rise to the highest printed rebound."""
    heights, g = DROP.points(paper)[1], paper.value("gravity")
    needed = sum(np.sqrt(2e-3 * h / g) for h in (paper.value("drop_height"), heights.max()))
    return Found(needed, holds=claim.value >= needed)


def tangents(paper: Paper) -> Cells:
    """The friction that each angle of Table 8 implies."""
    printed = paper.printed(TILT.table, TILT.parameter)
    for row, (cell, angle) in enumerate(zip(printed, TILT.points(paper)[1], strict=True), start=1):
        late = angle - np.degrees(np.arctan(cell.value))
        names = {"row": row, "late": abs(late), "when": "after" if late > 0 else "before"}
        value = np.tan(np.radians(angle))
        yield "table08.tangent.{row}", cell.text, Found(value, names=names)


def _yield_locus(paper, claim):
    """Slope or intercept of readings_yield_locus.csv; the intercept's share of the frictional
    strength at the depth of a conical heap that covers the base plate."""
    value = None
    if paper.has("readings_yield_locus"):
        points = paper.numbers("readings_yield_locus", "normal_stress_kPa", "shear_stress_kPa")
        line = np.polyfit(points.normal_stress_kPa, points.shear_stress_kPa, 1)
        value = line[int(claim.part == "intercept")]
    slope = np.tan(np.radians(paper.value("measured_angle_of_repose")))
    height_m = 0.5e-3 * paper.value("base_plate_diameter") * slope
    stress = paper.value("section_1_1_density") * paper.value("gravity") * height_m
    intercept, friction = map(paper.value, ("yield_locus_intercept", "yield_locus_slope"))
    return Found(value, names={"share": 1e3 * intercept / (friction * stress)})


def _yield_friction(paper, claim):
    slope = paper.scalar("yield_locus_slope")
    return Found(slope.value, half_width=slope.half_unit)


# --- time steps -----------------------------------------------------------------------------------


def stepped_restitution(restitution: np.ndarray, steps: float, phases: int = 200) -> np.ndarray:
    """Rebound over impact speed when a contact is integrated with few steps.

    In units of the speed, m* and the Hertz stiffness: x'' = -x^(3/2) - 2 sqrt(5/6) beta sqrt(S) x',
    S = (3/2) sqrt(x), attractive end kept; semi-implicit Euler, `steps` time steps in the elastic
    contact's duration. The first step ends anywhere in the contact: `phases` evenly spaced starts.

    Parameters
    ----------
    restitution : (k,) nominal values in (0, 1)

    Returns
    -------
    (k, phases)
    """
    log_e = np.log(np.asarray(restitution, float))[:, None]
    damping = 2 * np.sqrt(5 / 6) * (-log_e / np.sqrt(log_e**2 + np.pi**2))
    dt = DURATION_OVER_OVERLAP_TIME * 1.25**0.4 / steps
    x = np.broadcast_to(-dt * (np.arange(phases) + 0.5) / phases, (len(log_e), phases)).copy()
    v = np.ones_like(x)
    for _ in range(int(20 * steps) + 20):
        overlap = np.maximum(x, 0)
        v -= dt * (overlap**1.5 + damping * np.sqrt(1.5 * np.sqrt(overlap)) * v)
        x += dt * v
        if np.all((x < 0) & (v < 0)):
            break
    return -v


def _salt_constants(paper):
    """Shear modulus [Pa] and Poisson ratio of the salt: settings.csv's where it has them; else
    Section 1.1's if the density beside them is the salt's; else None."""
    shear, poisson = map(paper.optional, ("salt_shear_modulus_Pa", "salt_poisson_ratio"))
    if shear is not None and poisson is not None:
        return shear, poisson
    if paper.value("section_1_1_density") != intrinsic(paper, "salt_density").value:
        return None
    return 1e6 * paper.value("section_1_1_shear_modulus"), paper.value("section_1_1_poisson_ratio")


def _by_diameter(paper, judged):
    """{simulated diameter: Found}, sieve size times scale factor; judged(radius [m], density,
    constants) gives each. The paper prints no constants of the salt where these are None."""
    constants, scale = _salt_constants(paper), paper.value("scale_factor")
    density = intrinsic(paper, "salt_density").value
    sizes = [scale * float(d) for d in SIEVES_MM]
    return {
        f"{d:g}mm": Found(None) if constants is None else judged(0.5e-3 * d, density, constants)
        for d in sizes
    }


def _below_rayleigh(paper, claim):
    def judged(radius, density, constants):
        limit = rayleigh_time(radius, density, *constants)
        share = claim.value / limit
        return Found(limit, holds=share < 1, names={"share": share})

    return _by_diameter(paper, judged)


def _shorter_than_contact(paper, claim):
    names = ("density", "shear_modulus", "poisson_ratio")
    plate = Material(*(intrinsic(paper, f"steel_{n}").value for n in names))
    speed = np.sqrt(2e-3 * paper.value("drop_height") * paper.value("gravity"))

    def judged(radius, density, constants):
        duration = hertz_contact_time(radius, speed, Material(density, *constants), plate)
        steps = duration / claim.value
        return Found(duration, holds=steps > 1, names={"steps": steps})

    return _by_diameter(paper, judged)


def _law_heights(paper):
    return DROP.points(paper)[0] ** 2 * paper.value("drop_height")


def _stepped_heights(paper, steps):
    """Lowest and highest rebound [mm] that `steps` steps in a contact give each row of Table 9, and
    which of the printed heights lie between them, (n,) each."""
    restitution, printed = DROP.points(paper)
    band = stepped_restitution(restitution, steps) ** 2 * paper.value("drop_height")
    low, high = band.min(axis=1), band.max(axis=1)
    return low, high, (low <= printed) & (printed <= high)


def _heights_on_law(paper, claim):
    heights = zip(paper.printed(DROP.table, DROP.response), _law_heights(paper), strict=True)
    on = sum(abs(cell.value - h) <= cell.half_unit * (1 + 1e-9) for cell, h in heights)
    counts = []
    for steps in (*FEW_STEPS, 20.0, 100.0):
        low, high, inside = _stepped_heights(paper, steps)
        width = np.mean(high - low)
        counts.append(f"{inside.sum()} at N = {steps:g} (ranges {width:.1f} mm wide)")
    return Found(on, names={"counts": ", ".join(counts)})


def heights(paper: Paper) -> Cells:
    """The rebounds of Table 9."""
    within = {f"{s:g}": _stepped_heights(paper, s)[2] for s in FEW_STEPS}
    printed, law_heights = paper.printed(DROP.table, DROP.response), _law_heights(paper)
    for i, e in enumerate(DROP.points(paper)[0]):
        cell, law = printed[i], law_heights[i]
        steps = ", ".join(s for s, inside in within.items() if inside[i])
        names = {"row": i + 1, "e": e, "off": cell.value / law - 1}
        names["steps"] = steps or "neither 3, 3.5 nor 4"
        yield "table09.height.{row}", cell.text, Found(law, names=names)


def _generation(paper, claim):
    needed = paper.value("particle_count") / paper.value("generation_rate")
    return Found(needed, holds=needed <= claim.value)


CLAIMS: Claims = {
    "table08.groups table09.groups": lambda paper, claim: len(_points(paper, claim)[0]),
    "table08.low table09.low": _end(np.min),
    "table08.high table09.high": _end(np.max),
    "table08.step table09.step": _increment,
    "table08.range table09.range": _implied_count,
    "tilt.r2 drop.r2": _fit_r2,
    "tilt.inverse drop.inverse": _inverse_of_print,
    "tilt.refit drop.refit": _inverse_of_fit,
    "tilt.direct": _direct_tilt,
    "drop.direct": _direct_drop,
    "tilt.error drop.error": _confirmation_error,
    "tilt.between drop.between": _between,
    **{
        f"{t}.{of}": _readings(f"{t}_{of}")
        for t in ("tilt", "drop")
        for of in ("bench", "simulated")
    },
    "tilt.reach": _tilt_reach,
    "drop.duration": _drop_duration,
    "shear.slope shear.intercept": _yield_locus,
    "shear.friction": _yield_friction,
    "shear.particle": _readings("particle_shear_slope"),
    "tilt.time_step drop.time_step": _below_rayleigh,
    "drop.contact": _shorter_than_contact,
    "table09.law": _heights_on_law,
    "heap.generation": _generation,
}
CELLS = coefficients, tangents, heights
