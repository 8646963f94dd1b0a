"""Tables 1 to 5 and Eq. 16: the paper's measurements recomputed, and its settings beside the ones
in use here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from calibration.study.factors import read_factors
from paper.reproduction.rows import (
    ARITHMETIC,
    NOT_COMPARABLE,
    SETTINGS,
    Place,
    absent,
    exact,
    printed_of,
    words,
)

if TYPE_CHECKING:
    from calibration.study.config import Config
    from paper.audit.paper import Paper


RECOMPUTED = "recomputed from the paper's own readings"
SET = "set from the paper"
TABLE_4 = {
    "salt_density": ("particle", "density_kg_m3", "kg/m3"),
    "steel_poisson_ratio": ("wall", "poisson_ratio", "1"),
    "steel_density": ("wall", "density_kg_m3", "kg/m3"),
    "steel_shear_modulus": ("wall", "shear_modulus_Pa", "Pa"),
}


def rows(paper: Paper, config: Config) -> Iterator[dict[str, Any]]:
    """Rows of Tables 1 to 5 and Eq. 16."""
    yield from _table_1(paper)
    yield from _means_of_columns(paper)
    yield from _density(paper)
    yield from _table_4(paper, config)
    yield from _table_5(paper, config)


def _table_1(paper):
    readings = paper.angles()
    printed = dict(
        zip(
            paper.text("table01_printed_means")["group"],
            paper.printed("table01_printed_means", "mean"),
            strict=True,
        )
    )
    for group, angles in readings.groupby("group")["angle_deg"]:
        place = Place(
            "Table 1",
            f"table01.group{group:g}",
            f"mean of group {group:g}",
            "deg",
            evidence=ARITHMETIC,
        )
        yield exact(place, printed[f"{group:g}"], float(angles.mean()), RECOMPUTED)
    place = Place(
        "Table 1", "table01.mean", "measured angle of repose", "deg", "", True, ARITHMETIC
    )
    total = paper.scalar("measured_angle_of_repose")
    yield exact(place, total, float(readings["angle_deg"].mean()), RECOMPUTED)


def _means_of_columns(paper):
    table = paper.numbers("table02_sieve_fractions")
    printed = paper.text("table02_printed_means", "sieve_mm", "mean")
    for sieve, mean in zip(printed["sieve_mm"], printed["mean"], strict=True):
        place = Place(
            "Table 2",
            f"table02.{sieve}mm",
            f"mean share on the {sieve} mm sieve",
            "%",
            evidence=ARITHMETIC,
        )
        yield exact(place, printed_of(mean), float(table[sieve].mean()), RECOMPUTED)


def _density(paper):
    table = paper.numbers("table03_density", "mass_g", "volume_cm3")
    density = 1e3 * table["mass_g"] / table["volume_cm3"]
    printed = paper.printed("table03_density", "density_printed_kg_m3")
    for k, (value, text) in enumerate(zip(density, printed, strict=True), start=1):
        place = Place(
            "Eq. 16",
            f"table03.row{k}",
            f"density, row {k} of Table 3",
            "kg/m3",
            evidence=ARITHMETIC,
        )
        yield exact(place, text, float(value), RECOMPUTED)
    place = Place("Table 3", "table03.mean", "mean density", "kg/m3", evidence=ARITHMETIC)
    yield exact(place, printed_of("1210"), float(density.mean()), RECOMPUTED)


def _table_4(paper, config):
    table = paper.text("table04_intrinsic", "parameter", "value")
    for name, text in zip(table["parameter"], table["value"], strict=True):
        body, key, unit = TABLE_4[name]
        place = Place("Table 4", f"table04.{name}", name.replace("_", " "), unit, evidence=SETTINGS)
        ours = config.run.get("materials", {}).get(body, {}).get(key)
        if ours is None:
            yield absent(place, text, NOT_COMPARABLE, "not set in this study")
        else:
            yield exact(place, printed_of(text), float(ours), SET)


def _table_5(paper, config):
    ours = {f.name: f for f in read_factors(config.factors)}
    table = paper.text("table05_contact_parameter_ranges", "name", "low", "high")
    for name, low, high in zip(table["name"], table["low"], table["high"], strict=True):
        place = Place(
            "Table 5", f"table05.{name}", f"range of {name.replace('_', ' ')}", evidence=SETTINGS
        )
        paper_range = f"{float(low):g} to {float(high):g}"
        if name not in ours:
            yield absent(place, paper_range, NOT_COMPARABLE, "no factor of this study")
            continue
        factor = ours[name]
        yield words(place, paper_range, f"{factor.low:g} to {factor.high:g}", SET)


def simulated_sd(paper: Paper) -> float:
    """Scatter of the paper's own runs at one point [deg]: standard deviation of the 25 angles of
    Table 13."""
    return float(paper.numbers("table13_validation", "angle_deg")["angle_deg"].std(ddof=1))
