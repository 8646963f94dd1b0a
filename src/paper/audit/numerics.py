"""Time steps, durations and what too few steps in a contact do to Table 9."""

from collections.abc import Iterator

import numpy as np

from paper.audit.bench import SWEEPS, points
from paper.audit.contact import (
    contact_time,
    effective_modulus,
    rayleigh_time,
    stepped_restitution,
)
from paper.audit.intrinsic import SIEVES_MM, intrinsic
from paper.audit.paper import Claim, Paper
from paper.audit.verdict import Recomputed, claim_check, number, table_check

FEW_STEPS = (3.0, 3.5, 4.0)
NO_MODULUS = "The paper prints no shear modulus for the salt: its time step cannot be judged."


def salt_constants(paper: Paper) -> tuple[float, float] | None:
    """Shear modulus [Pa] and Poisson ratio of the salt.

    settings.csv's where it has them; else Section 1.1's if the density beside them is the salt's;
    else None.
    """
    shear, poisson = paper.optional("salt_shear_modulus_Pa"), paper.optional("salt_poisson_ratio")
    if shear is not None and poisson is not None:
        return shear, poisson
    if paper.value("section_1_1_density") != intrinsic(paper, "salt_density").value:
        return None
    return 1e6 * paper.value("section_1_1_shear_modulus"), paper.value("section_1_1_poisson_ratio")


def _diameters(paper: Paper) -> dict[str, float]:
    """Simulated diameters [m], sieve size times scale factor, by name."""
    scale = paper.value("scale_factor")
    return {f"{scale * float(d):g}mm": 1e-3 * scale * float(d) for d in SIEVES_MM}


@claim_check("tilt.time_step", "drop.time_step")
def below_rayleigh(paper: Paper, claim: Claim) -> dict[str, Recomputed]:
    return {name: _rayleigh(paper, claim, d / 2) for name, d in _diameters(paper).items()}


def _rayleigh(paper: Paper, claim: Claim, radius: float) -> Recomputed:
    constants = salt_constants(paper)
    if constants is None:
        return Recomputed(None, unknown=NO_MODULUS)
    limit = rayleigh_time(radius, intrinsic(paper, "salt_density").value, *constants)
    share = number(claim).value / limit
    return Recomputed(
        limit,
        holds=share < 1,
        agrees=f"{share:.0%} of the Rayleigh time; 20 to 40 % is usual.",
        disagrees=f"{share:.0%} of the Rayleigh time: with the stated modulus the integration is "
        f"not stable. The "
        "simulations must have used a softer salt or larger grains.",
    )


@claim_check("drop.contact")
def shorter_than_contact(paper: Paper, claim: Claim) -> dict[str, Recomputed]:
    return {name: _contact(paper, claim, d / 2) for name, d in _diameters(paper).items()}


def _contact(paper: Paper, claim: Claim, radius: float) -> Recomputed:
    constants = salt_constants(paper)
    if constants is None:
        return Recomputed(None, unknown=NO_MODULUS)
    plate = (
        intrinsic(paper, "steel_shear_modulus").value,
        intrinsic(paper, "steel_poisson_ratio").value,
    )
    speed = np.sqrt(2e-3 * paper.value("drop_height") * paper.value("gravity"))
    density = intrinsic(paper, "salt_density").value
    duration = contact_time(radius, density, effective_modulus(*constants, *plate), speed)
    steps = duration / number(claim).value
    return Recomputed(
        duration,
        holds=steps > 1,
        agrees=f"{steps:.1f} steps in the contact; some 20 are needed for the nominal restitution.",
        disagrees=f"{steps:.2f} steps in the contact: the impact falls between two steps, and the "
        f"rebound is not the "
        "nominal restitution's.",
    )


def _law_heights(paper: Paper) -> np.ndarray:
    return points(paper, SWEEPS["drop"])[0] ** 2 * paper.value("drop_height")


def stepped_heights(paper: Paper, steps: float) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest rebound [mm] that `steps` steps in a contact give each row of Table 9,
    (n,) each."""
    band = stepped_restitution(points(paper, SWEEPS["drop"])[0], steps) ** 2 * paper.value(
        "drop_height"
    )
    return band.min(axis=1), band.max(axis=1)


def heights_within(paper: Paper, steps: float) -> np.ndarray:
    """Which heights of Table 9 lie among those that `steps` steps in a contact can give, (n,)
    bool."""
    (low, high), (_, printed) = stepped_heights(paper, steps), points(paper, SWEEPS["drop"])
    return (low <= printed) & (printed <= high)


def _count_within(paper: Paper, steps: float) -> str:
    low, high = stepped_heights(paper, steps)
    count, width = heights_within(paper, steps).sum(), np.mean(high - low)
    return f"{count} at N = {steps:g} (ranges {width:.1f} mm wide)"


@claim_check("table09.law")
def heights_on_law(paper: Paper, claim: Claim) -> Recomputed:
    cells = paper.printed("table09_drop_test", "rebound_height_mm")
    law = _law_heights(paper)
    on = sum(
        abs(cell.value - h) <= cell.half_unit * (1 + 1e-9)
        for cell, h in zip(cells, law, strict=True)
    )
    counts = ", ".join(_count_within(paper, steps) for steps in (*FEW_STEPS, 20.0, 100.0))
    return Recomputed(
        int(on),
        agrees="The simulated test reproduces its own restitution.",
        disagrees="The simulated rebound is not the restitution put in. Heights inside the range "
        "that N steps in a "
        f"contact give, by the step in which it begins: {counts}. The sweep calibrates the time "
        f"step as much as the "
        "restitution.",
    )


@table_check
def heights(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    sweep = SWEEPS["drop"]
    within = {s: heights_within(paper, s) for s in FEW_STEPS}
    cells = paper.printed(sweep.table, sweep.response)
    for i, (e, cell, law) in enumerate(
        zip(points(paper, sweep)[0], cells, _law_heights(paper), strict=True)
    ):
        steps = [f"{s:g}" for s, inside in within.items() if inside[i]]
        claim = Claim(
            f"table09.height.{i + 1}",
            "Table 9, Eq. 22",
            f"implied: rebound height at e = {e:g}",
            cell.text,
            "mm",
        )
        yield (
            claim,
            Recomputed(
                float(law),
                disagrees=f"{cell.value / law - 1:+.1%} against e^2 H; "
                f"{', '.join(steps) or 'neither 3, 3.5 nor 4'} "
                "steps in a contact can give it.",
            ),
        )


@claim_check("heap.generation")
def generation(paper: Paper, claim: Claim) -> Recomputed:
    needed = paper.value("particle_count") / paper.value("generation_rate")
    return Recomputed(
        needed,
        holds=needed <= number(claim).value,
        agrees=f"Generation ends after {needed:g} s; the time left is for the outflow and the heap "
        f"to settle.",
        disagrees="The simulation ends before all particles are generated.",
    )
