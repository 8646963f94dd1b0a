"""Tables 8 and 9, the yield locus and the time steps: bench tests, their fits (Eq. 21, 23, 26) and
inverses, and what too few steps in a contact do to Table 9."""

from functools import lru_cache, partial

import numpy as np

from dem.contact.registry import Material
from dem.timescales import hertz_contact_time, rayleigh_time
from paper.audit.materials import SIEVES_MM, intrinsic
from paper.audit.paper import TABLES, Cells, Claims, Found, propagate

# Hertz: duration = 2.9432 x peak overlap / speed (Johnson, Contact Mechanics, 1985, 11.4).
DURATION_OVER_OVERLAP_TIME = 2.9432
FEW_STEPS = (3.0, 3.5, 4.0)


TILT, DROP = TABLES["Table 8"], TABLES["Table 9"]
SWEEPS = dict.fromkeys(("table08", "tilt", "eq21"), TILT)
SWEEPS |= dict.fromkeys(("table09", "drop", "eq23"), DROP)
"""First part of a claim's id: sweep."""


def r_squared(y: np.ndarray, predicted: np.ndarray) -> float:
    """1 - residual over total sum of squares, of any curve."""
    return float(1 - np.sum((y - predicted) ** 2) / np.sum((y - y.mean()) ** 2))


def _points(paper, claim):
    return SWEEPS[claim.group].points(paper)


def _readings(paper, claim):
    """Mean of readings_<name>.csv, None where the paper does not print them and no such file was
    added."""
    name = "particle_shear_slope" if claim.group == "shear" else claim.id.replace(".", "_")
    file = f"readings_{name}"
    return paper.numbers(file, "value").value.mean() if paper.has(file) else None


def _increment(paper, claim):
    steps = np.diff(_points(paper, claim)[0])
    even = np.ptp(steps) < 1e-9
    return Found(np.median(steps), exact=True, holds=None if even else False)


def _implied_count(paper, claim):
    ends = (f"{claim.group}.{end}" for end in ("low", "high", "step"))
    low, high, step = (paper.claims[end].value for end in ends)
    return round((high - low) / step) + 1


def _printed_coefficients(paper):
    return [
        {"equation": sweep.equation, "where": f"Eq. {sweep.equation[2:]}", "unit": sweep.unit,
         "power": power, "printed": cell.text}
        for sweep in (TILT, DROP)
        for power, cell in zip((2, 1, 0), sweep.curve(paper), strict=True)
    ]  # fmt: skip


def _coefficient(paper, row):
    sweep = SWEEPS[row["equation"]]
    x, y = sweep.points(paper)
    printed = np.polyval([p.value for p in sweep.curve(paper)], x)
    return Found(np.polyfit(x, y, 2)[2 - row["power"]], deviation=np.abs(printed - y).max())


def _fit(paper, claim):
    return np.polyfit(*_points(paper, claim), deg=2)


def _fit_r2(paper, claim):
    x, y = _points(paper, claim)
    printed = [p.value for p in SWEEPS[claim.group].curve(paper)]
    best, curve = (r_squared(y, np.polyval(c, x)) for c in (_fit(paper, claim), printed))
    return Found(best, curve=curve)


def _inverse(paper, claim, curve):
    """The parameter at which a quadratic, highest power first, gives the measured response: the
    root nearest the middle of the table; nan if none. What is measured was put into the equation
    and counts as exact."""
    x, _ = _points(paper, claim)
    measured = paper.value(SWEEPS[claim.group].measured)
    roots = np.roots(np.asarray(curve, float) - [0.0, 0.0, measured])
    real = roots[np.isreal(roots)].real
    return real[np.argmin(np.abs(real - (x.min() + x.max()) / 2))] if len(real) else np.nan


def _inverse_of_print(paper, claim):
    printed, inverse = SWEEPS[claim.group].curve(paper), partial(_inverse, paper, claim)
    return Found(inverse([p.value for p in printed]), propagate(inverse, printed))


def _between(paper, claim):
    x, y = _points(paper, claim)
    at = paper.value(SWEEPS[claim.group].parameter)
    low, high = y[x <= at].max(initial=-np.inf), y[x >= at].min(initial=np.inf)
    return Found(f"{low:g} to {high:g}", holds=low <= claim.value <= high, at=at)


def _lasts(paper, claim):
    """Return whether a printed duration is at least what is needed [s]: to make all grains, to tilt
    to the largest angle, to fall and rise to the highest rebound."""
    if claim.group == "heap":
        needed = paper.value("particle_count") / paper.value("generation_rate")
    elif claim.group == "tilt":
        tilted = TILT.points(paper)[1].max() / paper.value("inclined_plane_tilt_rate")
        needed = paper.value("tilt_start") + tilted
    else:
        heights = (paper.value("drop_height"), DROP.points(paper)[1].max())
        needed = sum(np.sqrt(2e-3 * h / paper.value("gravity")) for h in heights)
    return Found(needed, holds=claim.value >= needed)


def _tangent(paper, row):
    """The friction that an angle of Table 8 implies."""
    friction, angle = (column[row["row"] - 1] for column in TILT.points(paper))
    late = angle - np.degrees(np.arctan(friction))
    when = "after" if late > 0 else "before"
    return Found(np.tan(np.radians(angle)), late=abs(late), when=when)


def _yield_locus(paper, claim):
    """Slope or intercept of readings_yield_locus.csv; the intercept's share of the frictional
    strength at the depth of a conical heap that covers the base plate."""
    value = None
    if paper.has("readings_yield_locus"):
        points = paper.numbers("readings_yield_locus", "normal_stress_kPa", "shear_stress_kPa")
        value = np.polyfit(*points.to_numpy().T, 1)[int(claim.part == "intercept")]
    slope = np.tan(np.radians(paper.value("measured_angle_of_repose")))
    height_m = 0.5e-3 * paper.value("base_plate_diameter") * slope
    stress = paper.value("section_1_1_density") * paper.value("gravity") * height_m
    intercept, friction = map(paper.value, ("yield_locus_intercept", "yield_locus_slope"))
    return Found(value, share=1e3 * intercept / (friction * stress))


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


def _longer_times(paper, claim):
    """{simulated diameter: Found}, sieve size times scale factor: whether the time step is below a
    grain's Rayleigh time, or below the contact of one that falls on the plate of the drop test. The
    paper may print no constants of the salt."""
    names = ("density", "shear_modulus", "poisson_ratio")
    plate = Material(*(intrinsic(paper, f"steel_{n}").value for n in names))
    speed = np.sqrt(2e-3 * paper.value("drop_height") * paper.value("gravity"))
    constants, scale = _salt_constants(paper), paper.value("scale_factor")
    density, every = intrinsic(paper, "salt_density").value, {}
    for diameter in (scale * float(size) for size in SIEVES_MM):
        radius, every[f"{diameter:g}mm"] = 0.5e-3 * diameter, Found(None)
        if constants is not None:
            limit = rayleigh_time(radius, density, *constants)
            if claim.part == "contact":
                limit = hertz_contact_time(radius, speed, Material(density, *constants), plate)
            share, steps = claim.value / limit, limit / claim.value
            every[f"{diameter:g}mm"] = Found(limit, holds=share < 1, share=share, steps=steps)
    return every


def _law_heights(paper):
    return DROP.points(paper)[0] ** 2 * paper.value("drop_height")


@lru_cache(maxsize=8)
def _stepped_heights(paper, steps):
    """Lowest and highest rebound [mm] that `steps` steps in a contact give each row of Table 9, and
    which of the printed heights lie between them, (n,) each."""
    restitution, printed = DROP.points(paper)
    band = stepped_restitution(restitution, steps) ** 2 * paper.value("drop_height")
    low, high = band.min(axis=1), band.max(axis=1)
    return low, high, (low <= printed) & (printed <= high)


def _heights_on_law(paper, claim):
    heights = zip(paper.printed(DROP.file, DROP.column), _law_heights(paper), strict=True)
    on = sum(abs(cell.value - h) <= cell.half_unit * (1 + 1e-9) for cell, h in heights)
    counts = []
    for steps in (*FEW_STEPS, 20.0, 100.0):
        low, high, inside = _stepped_heights(paper, steps)
        width = np.mean(high - low)
        counts.append(f"{inside.sum()} at N = {steps:g} (ranges {width:.1f} mm wide)")
    return Found(on, counts=", ".join(counts))


def _height(paper, row):
    k, (restitution, heights) = row["row"] - 1, DROP.points(paper)
    law = _law_heights(paper)[k]
    steps = ", ".join(f"{s:g}" for s in FEW_STEPS if _stepped_heights(paper, s)[2][k])
    off = heights[k] / law - 1
    return Found(law, e=restitution[k], off=off, steps=steps or "neither 3, 3.5 nor 4")


CLAIMS: Claims = {
    "table08.groups table09.groups": lambda paper, claim: len(_points(paper, claim)[0]),
    "table08.low table09.low": lambda *of: Found(_points(*of)[0].min(), exact=True),
    "table08.high table09.high": lambda *of: Found(_points(*of)[0].max(), exact=True),
    "table08.step table09.step": _increment,
    "table08.range table09.range": _implied_count,
    "tilt.r2 drop.r2": _fit_r2,
    "tilt.inverse drop.inverse": _inverse_of_print,
    "tilt.refit drop.refit": lambda paper, claim: _inverse(paper, claim, _fit(paper, claim)),
    "tilt.direct": lambda paper, _: Found(
        np.tan(np.radians(paper.value(TILT.measured))), law="tan(angle)"
    ),
    "drop.direct": lambda paper, _: Found(
        np.sqrt(paper.value(DROP.measured) / paper.value("drop_height")), law="sqrt(h/H)"
    ),
    "tilt.error drop.error": lambda paper, claim: paper.miss(
        SWEEPS[claim.group].confirmed, SWEEPS[claim.group].measured
    ),
    "tilt.between drop.between": _between,
    "tilt.bench tilt.simulated drop.bench drop.simulated shear.particle": _readings,
    "heap.generation tilt.reach drop.duration": _lasts,
    "shear.slope shear.intercept": _yield_locus,
    "shear.friction": lambda paper, _: Found(
        paper.value("yield_locus_slope"), paper.scalar("yield_locus_slope").half_unit
    ),
    "tilt.time_step drop.time_step drop.contact": _longer_times,
    "table09.law": _heights_on_law,
}
CELLS: Cells = {
    "table08.tangent.{row}": (TILT.file, TILT.parameter, _tangent),
    "table09.height.{row}": (DROP.file, DROP.column, _height),
    "{equation}.c{power}": (_printed_coefficients, "printed", _coefficient),
}
