"""Tables 8 and 9 and the yield locus: bench tests, their fits (Eq. 21, 23, 26) and inverses."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from paper.audit.fits import inverse_quadratic, r_squared
from paper.audit.paper import Claim, Paper
from paper.audit.printed import Printed, propagate
from paper.audit.verdict import Recomputed, claim_check, number, table_check


@dataclass(frozen=True)
class Sweep:
    """A bench test's simulated sweep: where its parameter, response, fit and measured value
    stand."""

    table: str
    parameter: str
    response: str
    equation: str
    measured: str
    calibrated: str
    confirmed: str
    unit: str
    where: str


SWEEPS = {
    "tilt": Sweep(
        "table08_inclined_plane",
        "salt_steel_static_friction",
        "angle_deg",
        "eq21",
        "measured_inclined_plane_angle",
        "salt_steel_static_friction",
        "simulated_tilt_angle",
        "deg",
        "Eq. 21",
    ),
    "drop": Sweep(
        "table09_drop_test",
        "salt_steel_restitution",
        "rebound_height_mm",
        "eq23",
        "measured_rebound_height",
        "salt_steel_restitution",
        "simulated_rebound_at_0.421",
        "mm",
        "Eq. 23",
    ),
}


def points(paper: Paper, sweep: Sweep) -> tuple[np.ndarray, np.ndarray]:
    """Parameter (n,) and response (n,) of a sweep."""
    table = paper.numbers(sweep.table, sweep.parameter, sweep.response)
    return table[sweep.parameter].to_numpy(), table[sweep.response].to_numpy()


def printed_coefficients(paper: Paper, sweep: Sweep) -> list[Printed]:
    """The printed quadratic's coefficients, highest power first."""
    parsed = [
        Printed.parse(text) for text in paper.scalar_text(f"{sweep.equation}_coefficients").split()
    ]
    return [p for p in parsed if p is not None]


def readings(paper: Paper, name: str) -> float | None:
    """Mean of readings_<name>.csv, None where the paper does not print them and no such file was
    added."""
    file = f"readings_{name}"
    return float(paper.numbers(file, "value")["value"].mean()) if paper.has(file) else None


def _sweep(claim: Claim) -> Sweep:
    return SWEEPS[
        {"table08": "tilt", "table09": "drop"}.get(claim.id.split(".")[0], claim.id.split(".")[0])
    ]


@claim_check("table08.groups", "table09.groups")
def group_count(paper: Paper, claim: Claim) -> Recomputed:
    n = len(points(paper, _sweep(claim))[0])
    return Recomputed(
        n,
        disagrees=f"The table has {n} groups: the text describes another set of runs than it "
        f"prints.",
    )


@claim_check("table08.low", "table09.low", "table08.high", "table09.high")
def range_ends(paper: Paper, claim: Claim) -> Recomputed:
    x = points(paper, _sweep(claim))[0]
    value = float(x.min() if claim.id.endswith("low") else x.max())
    return Recomputed(
        value,
        exact=True,
        disagrees=f"The table ends at {value:g}: the fit says nothing about the stated rest of the "
        f"range.",
    )


@claim_check("table08.step", "table09.step")
def increment(paper: Paper, claim: Claim) -> Recomputed:
    steps = np.diff(points(paper, _sweep(claim))[0])
    even = np.ptp(steps) < 1e-9
    return Recomputed(
        float(np.median(steps)),
        exact=True,
        holds=None if even else False,
        disagrees="The levels are spaced otherwise.",
    )


@claim_check("table08.range", "table09.range")
def implied_count(paper: Paper, claim: Claim) -> Recomputed:
    prefix = claim.id.split(".")[0]
    low, high, step = (
        number(paper.claims[f"{prefix}.{end}"]).value for end in ("low", "high", "step")
    )
    return Recomputed(
        round((high - low) / step) + 1,
        disagrees="The stated number of groups, range and increment contradict one another.",
    )


@table_check
def coefficients(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    for sweep in SWEEPS.values():
        x, y = points(paper, sweep)
        fit, printed = np.polyfit(x, y, 2), printed_coefficients(paper, sweep)
        deviation = np.abs(np.polyval([p.value for p in printed], x) - y).max()
        for power, value, cell in zip((2, 1, 0), fit, printed, strict=True):
            claim = Claim(
                f"{sweep.equation}.c{power}",
                sweep.where,
                f"Coefficient of x^{power} in the fit of the table",
                cell.text,
                sweep.unit,
            )
            yield (
                claim,
                Recomputed(
                    float(value),
                    disagrees=f"{sweep.where} is not the least-squares fit of the printed table; "
                    f"it misses a "
                    f"point by up to {deviation:.2f} {sweep.unit}. Fit the table.",
                ),
            )


@claim_check("tilt.r2", "drop.r2")
def fit_r2(paper: Paper, claim: Claim) -> Recomputed:
    x, y = points(paper, _sweep(claim))
    best = r_squared(y, np.polyval(np.polyfit(x, y, 2), x))
    curve = r_squared(
        y, np.polyval([p.value for p in printed_coefficients(paper, _sweep(claim))], x)
    )
    return Recomputed(
        best,
        disagrees=f"The best quadratic reaches {best:.4f} and the printed curve {curve:.4f}: the "
        f"printed R2 belongs "
        "to neither.",
    )


@claim_check("tilt.inverse", "drop.inverse")
def inverse_of_print(paper: Paper, claim: Claim) -> Recomputed:
    sweep = _sweep(claim)
    x, _ = points(paper, sweep)
    inputs = [*printed_coefficients(paper, sweep), paper.scalar(sweep.measured)]

    def inverse(values):
        return inverse_quadratic(values[:3], values[3], x.min(), x.max())

    exact = Printed(
        inputs[3].text, inputs[3].value, 0.0
    )  # the measured mean is what was put into the equation
    return Recomputed(
        inverse([p.value for p in inputs]), half_width=propagate(inverse, [*inputs[:3], exact])
    )


@claim_check("tilt.refit", "drop.refit")
def inverse_of_fit(paper: Paper, claim: Claim) -> Recomputed:
    sweep = _sweep(claim)
    x, y = points(paper, sweep)
    value = inverse_quadratic(np.polyfit(x, y, 2), paper.value(sweep.measured), x.min(), x.max())
    return Recomputed(
        value, disagrees=f"The least-squares fit of the table calibrates {value:.3f}."
    )


@claim_check("tilt.direct", "drop.direct")
def direct(paper: Paper, claim: Claim) -> Recomputed:
    measured = paper.value(_sweep(claim).measured)
    if claim.id == "tilt.direct":
        value, law = float(np.tan(np.radians(measured))), "tan(angle)"
    else:
        value, law = float(np.sqrt(measured / paper.value("drop_height"))), "sqrt(h/H)"
    return Recomputed(
        value,
        disagrees=f"The definition, {law}, gives {value:.3f} with no simulation; the difference is "
        f"the error of the "
        "simulated test, which the calibrated value now carries.",
    )


@claim_check("tilt.error", "drop.error")
def confirmation_error(paper: Paper, claim: Claim) -> Recomputed:
    sweep = _sweep(claim)
    measured = paper.value(sweep.measured)
    value = 100 * abs(paper.value(sweep.confirmed) - measured) / measured
    return Recomputed(
        value,
        agrees="The confirming runs are as close as stated.",
        disagrees=f"The confirming runs miss the measurement by {value:.1f} %, not {claim.printed} "
        f"%: the calibrated "
        "value is not confirmed to the stated accuracy.",
    )


@claim_check("tilt.between", "drop.between")
def between_neighbours(paper: Paper, claim: Claim) -> Recomputed:
    sweep = _sweep(claim)
    x, y = points(paper, sweep)
    at = paper.value(sweep.calibrated)
    low, high = y[x <= at].max(initial=-np.inf), y[x >= at].min(initial=np.inf)
    return Recomputed(
        f"{low:g} to {high:g}",
        holds=bool(low <= number(claim).value <= high),
        disagrees=f"The runs at {at:g} lie outside what the table gives on either side of it "
        f"({low:g} to {high:g} "
        f"{sweep.unit}): scatter or settings differ between the sweep and its confirmation.",
    )


@claim_check("tilt.bench", "tilt.simulated", "drop.bench", "drop.simulated")
def mean_of_readings(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        readings(paper, claim.id.replace(".", "_")),
        unknown="The five readings are not printed: neither the mean nor its scatter can be "
        "checked.",
    )


@claim_check("tilt.reach")
def tilt_reach(paper: Paper, claim: Claim) -> Recomputed:
    _, angles = points(paper, SWEEPS["tilt"])
    needed = paper.value("tilt_start") + angles.max() / paper.value("inclined_plane_tilt_rate")
    return Recomputed(
        float(needed),
        holds=number(claim).value >= needed,
        disagrees="The run ends before the plate reaches the largest printed angle.",
    )


@claim_check("drop.duration")
def drop_duration(paper: Paper, claim: Claim) -> Recomputed:
    """Fall, then rise to the highest printed rebound."""
    _, heights = points(paper, SWEEPS["drop"])
    g = paper.value("gravity")
    needed = sum(np.sqrt(2e-3 * h / g) for h in (paper.value("drop_height"), heights.max()))
    return Recomputed(
        float(needed),
        holds=number(claim).value >= needed,
        disagrees="The run ends before the top of the rebound.",
    )


@table_check
def tangents(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    sweep = SWEEPS["tilt"]
    _, angles = points(paper, sweep)
    for row, (cell, angle) in enumerate(
        zip(paper.printed(sweep.table, sweep.parameter), angles, strict=True), start=1
    ):
        late = angle - np.degrees(np.arctan(cell.value))
        claim = Claim(
            f"table08.tangent.{row}",
            "Table 8, Eq. 20",
            f"implied: the friction of row {row} is tan(angle)",
            cell.text,
            "1",
        )
        yield (
            claim,
            Recomputed(
                float(np.tan(np.radians(angle))),
                disagrees=f"The block slides {abs(late):.2f} deg "
                f"{'after' if late > 0 else 'before'} the angle that "
                "its friction allows: an error of the simulated test or of its reading.",
            ),
        )


def _yield_locus(paper: Paper) -> np.ndarray | None:
    """Slope and intercept of readings_yield_locus.csv, None where there is none."""
    if not paper.has("readings_yield_locus"):
        return None
    table = paper.numbers("readings_yield_locus", "normal_stress_kPa", "shear_stress_kPa")
    return np.polyfit(table.normal_stress_kPa, table.shear_stress_kPa, 1)


@claim_check("shear.slope", "shear.intercept")
def yield_locus(paper: Paper, claim: Claim) -> Recomputed:
    locus = _yield_locus(paper)
    unknown = (
        "The points of the yield locus are not printed: neither the line nor its interval "
        "can be checked."
    )
    if claim.id == "shear.slope":
        return Recomputed(None if locus is None else float(locus[0]), unknown=unknown)
    share = _intercept_share(paper)
    return Recomputed(
        None if locus is None else float(locus[1]),
        unknown=f"{unknown} At the foot of the heap the intercept is {share:.0%} of the frictional "
        f"strength, which a "
        "contact law without cohesion leaves out.",
    )


def _intercept_share(paper: Paper) -> float:
    """Intercept over slope x stress, at the depth of a conical heap that covers the base plate."""
    height_m = (
        0.5e-3
        * paper.value("base_plate_diameter")
        * np.tan(np.radians(paper.value("measured_angle_of_repose")))
    )
    stress = paper.value("section_1_1_density") * paper.value("gravity") * height_m
    return float(
        1e3 * paper.value("yield_locus_intercept") / (paper.value("yield_locus_slope") * stress)
    )


@claim_check("shear.friction")
def yield_friction(paper: Paper, claim: Claim) -> Recomputed:
    slope = paper.scalar("yield_locus_slope")
    return Recomputed(slope.value, half_width=slope.half_unit)


@claim_check("shear.particle")
def particle_friction(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        readings(paper, "particle_shear_slope"),
        unknown="The slope is a property of the bulk, which grain friction, shape and rolling make "
        "together; only a "
        "simulated shear test with that grain friction can say whether the two are equal.",
    )
