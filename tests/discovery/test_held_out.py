"""Rows held out are predicted by what the others say; remarks name lines."""

import numpy as np
import pytest

from benchmarks.rates.simulated import salt_settings
from calibration.intake.measurements import Measurement
from diagnosis import held_out, remarks
from diagnosis.contacts import defaults_of
from diagnosis.measurements import Measured
from diagnosis.table_model.found import discover
from facts import tells

SETTINGS = salt_settings()
HEIGHTS, SIZES = (40.0, 70.0, 120.0, 200.0, 330.0), (1.5, 2.5, 4.0)


def drop(height, size, rng=None, line=None, **more):
    """A rebound whose restitution falls with speed as v^(-0.1), known to 1 %."""
    value = height * 0.7**2 * (height / 100.0) ** -0.1
    value *= 1.0 + 0.01 * rng.standard_normal() if rng else 1.0
    levers = {"drop_height_mm": height, "particle_diameter_mm": size}
    return Measurement("drop", value, 0.0224 * value, 5, levers, line=line, **more)


def test_a_law_predicts_the_rows_that_were_held_out():
    rng = np.random.default_rng(4)
    fitted = [drop(h, d, rng) for h in HEIGHTS for d in SIZES]
    held = [drop(h, 2.0) for h in (50.0, 250.0)]
    found = discover(fitted, chance=(99,))
    assert found.law["slot"] == "restitution"
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
    two, alone, single, gone = remarks.remarks(Measured(fitted, [], [lost]))
    assert tells(two, "3, 4, 5", "rebound", "two levels", "drop height")
    assert tells(alone, "5", "batch late")
    assert tells(single, "6", "sliding angle", "single level")
    assert tells(gone, "7", "heap", "no fit")
    assert remarks.remarks(Measured(fitted, [], [lost]), ["heap"]) == [two, alone, single]
