"""Rows that no fit has used, and a mechanism of a study's own folder in a table of slides. Tables
and law are closed forms."""

import numpy as np
import pytest

from benchmarks.rates.simulated import salt_settings
from benchmarks.rates.strangers.ask import study
from calibration.intake.measurements import Measurement
from diagnosis import held_out, verdict
from diagnosis.catalogue import Mechanism, Strength
from diagnosis.contacts import defaults_of, discovered, of_found, with_engine
from diagnosis.laws.known import with_coefficient
from diagnosis.measurements import Measured
from diagnosis.page.markdown import said as line_of
from diagnosis.table_model.found import discover
from facts import tells

POWER, SIZES = 0.15, (1.0, 1.4, 2.0, 2.8, 4.0)


def coating(spec, strength):
    """A coat that is thinner on large grains: friction and restitution fall as a power of size."""
    name = {"tilt": "static_friction", "drop": "restitution"}[spec["experiment"]]
    factor = (spec["particles"]["diameter_mm"] / 2.0) ** -strength
    return with_coefficient(spec, name, factor * spec["contacts"]["particle_wall"][name])


CATALOGUE = {
    "coating": Mechanism("coating", "a coat", "none", ("tilt", "drop"),
                         Strength("exponent", "1", 0.0, 0.4), coating,
                         law=("friction", ("size",))),
}  # fmt: skip


def reading(kind, value, error, line, rng, **levers):
    read = value + error * rng.standard_normal(5)
    return Measurement(kind, read.mean(), read.std(ddof=1), 5, levers, line=line)


def slides(rng):
    angle = {d: np.degrees(np.arctan(0.5 * (d / 2.0) ** -POWER)) for d in SIZES}
    settings = [(r, d) for r in (2.0, 5.0, 10.0) for d in SIZES]
    return [reading("tilt", angle[d], 0.4, k + 2, rng, tilt_rate_deg_s=r, particle_diameter_mm=d)
            for k, (r, d) in enumerate(settings)]  # fmt: skip


def told(table):
    """What the diagnosis says of a table, with the engine's word."""
    found = discovered(table, study()[0], CATALOGUE)
    return with_engine(of_found(found, 0.05), table, found, study()[0], CATALOGUE)


@pytest.mark.slow
def test_a_named_mechanism_has_its_strength_beside_its_gain():
    said = told(slides(np.random.default_rng(8)))
    [own] = [r["strength"]["coating"] for r in said["ranking"] if r.get("strength")]
    assert own["low"] < POWER < own["high"]
    assert own["value"] == said["laws"][0]["strengths"]["coating"]
    assert "exponent" in line_of("cause", said)


SETTINGS = salt_settings()
HEIGHTS, DIAMETERS = (40.0, 70.0, 120.0, 200.0, 330.0), (1.5, 2.5, 4.0)


def drop(height, size, rng=None, line=None, **more):
    """A rebound whose restitution falls with speed as v^(-0.1), known to 1 %."""
    value = height * 0.7**2 * (height / 100.0) ** -0.1
    value *= 1.0 + 0.01 * rng.standard_normal() if rng else 1.0
    levers = {"drop_height_mm": height, "particle_diameter_mm": size}
    return Measurement("drop", value, 0.0224 * value, 5, levers, line=line, **more)


def test_a_law_predicts_the_rows_that_were_held_out():
    rng = np.random.default_rng(4)
    fitted = [drop(h, d, rng) for h in HEIGHTS for d in DIAMETERS]
    held = [drop(h, 2.0) for h in (50.0, 250.0)]
    found = discover(fitted, chance=(99,))
    assert found.laws[0]["slot"] == "restitution"
    defaults = defaults_of(SETTINGS, ["drop"])
    rows = held_out.by_contacts(fitted, held, found, defaults)
    for row, m in zip(rows, held, strict=True):
        assert row["after"] == pytest.approx(m.value, rel=0.01)
        assert abs(row["miss_after"]) < 1.0
        assert abs(row["measured"] - row["before"]) > 3.0 * abs(row["measured"] - row["after"])


def test_remarks_name_what_rows_cannot_tell():
    fitted = [drop(h, 2.0, line=3 + k) for k, h in enumerate((50.0, 100.0))]
    fitted.append(drop(100.0, 2.0, line=5, batch="late"))
    fitted.append(Measurement("tilt", 35.0, 0.4, 5, {"tilt_rate_deg_s": 5.0}, line=6))
    lost = Measurement("heap", np.nan, np.nan, 3, {}, line=7, outcome="no_heap")
    two, alone, single, gone = verdict.remarks(Measured(fitted, [], [lost]))
    assert tells(two, "3, 4, 5", "rebound", "two levels", "drop height")
    assert tells(alone, "5", "batch late")
    assert tells(single, "6", "sliding angle", "single level")
    assert tells(gone, "7", "heap", "no fit")
    assert verdict.remarks(Measured(fitted, [], [lost]), ["heap"]) == [two, alone, single]
