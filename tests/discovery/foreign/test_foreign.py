"""Laws of strangers: the diagnosis names slot and state of laws that no file of the project holds,
and no other.

The data sets are closed forms with noise (`strangers`). Default: one set of four laws, two nulls
and an outlier. Slow: all laws at ten standard errors and all nulls, with the rates that are asked
of them.
"""

import numpy as np
import pytest
import strangers

from diagnosis.laws.found import discover
from diagnosis.measurements import read_measurements

LAWS = {law.name: law for law in strangers.LAWS}


def found_in(drawn, tmp_path, replicates=99):
    """What the diagnosis finds in a `strangers.Set`, read from a file as a user's table is."""
    path = tmp_path / "measurements.csv"
    drawn.table.to_csv(path, index=False)
    return discover(read_measurements(path), replicates=replicates)


def right(found, law):
    return found.law is not None and (found.law["slot"], tuple(found.law["state"])) in law.right


def inside(found, drawn):
    """Whether the true curve lies in the band over the whole supported range."""
    _, state = drawn.law.right[0]
    for v in found.law["values"]:
        x = {
            k: np.array([np.nanmedian(c)]) for k, c in drawn.levers.items() if not np.isnan(c).all()
        }
        if state == ("speed",):
            x["drop_height_mm"] = np.array([v["state"] ** 2 / (2e-3 * strangers.G)])
        elif state == ("size",):
            x["particle_diameter_mm"] = np.array([v["state"]])
        elif state == ("rate",):
            x["tilt_rate_deg_s"] = np.array([v["state"]])
        else:
            x["particle_diameter_mm"] = v["state"] / strangers.speed(x["drop_height_mm"])
        true = float(drawn.law.curve(x, drawn.strength)[0])
        if not v["low"] <= true <= v["high"]:
            return False
    return True


@pytest.mark.parametrize(
    "name",
    ["power of speed", "lubrication film", "reading off by a radius", "logarithm of the rate"],
)
def test_slot_and_state_of_a_strangers_law_are_found(name, tmp_path):
    drawn = strangers.draw(LAWS[name], 20.0, seed=1)
    found = found_in(drawn, tmp_path)
    assert found.verdict != "adequate"
    assert right(found, LAWS[name]), found.law
    assert not found.causes  # without the catalogue nothing can be named


@pytest.mark.parametrize("kind", ["plain", "camera set up anew for each height"])
def test_data_without_a_law_are_adequate(kind, tmp_path):
    assert found_in(strangers.null(kind, seed=1), tmp_path).verdict == "adequate"


def test_one_mistyped_reading_is_pointed_out_by_its_line(tmp_path):
    drawn = strangers.null("one doubled reading", seed=1)
    row = drawn.table.index[drawn.table["note"] == "mistyped"][0]
    found = found_in(drawn, tmp_path)
    assert [o["line"] for o in found.outliers] == [row + 2]  # the header is line 1
    assert found.verdict == "adequate"


def test_an_error_between_settings_is_told_and_its_size_is_right(tmp_path):
    sds = []
    for seed in range(3):
        found = found_in(strangers.null("error between settings", seed), tmp_path, 19)
        sds += [s["sd"] for s in found.scatter] or [0.0]
    true = 2.0 * strangers.RELATIVE / strangers.REPLICATES**0.5
    assert 0.5 * true < np.median(sds) < 2.0 * true


@pytest.mark.long
@pytest.mark.slow
def test_rates_over_all_laws_of_strangers(tmp_path):
    hits, bands, nulls = [], [], []
    for law in strangers.LAWS:
        drawn = strangers.draw(law, 10.0, seed=7)
        found = found_in(drawn, tmp_path)
        hits.append(right(found, law))
        own = found.law and (found.law["slot"], tuple(found.law["state"])) == law.right[0]
        # what attraction adds is no coefficient
        if own and law.curve and law.right[0][0] in ("restitution", "friction"):
            bands.append(inside(found, drawn))
    for kind in strangers.NULLS:
        nulls += [
            found_in(strangers.null(kind, s, s), tmp_path).verdict == "adequate" for s in (7, 8)
        ]
    assert np.mean(hits) >= 0.8
    assert np.mean(bands) >= 0.8  # 90 % are asked; one of a dozen more may fall out by chance
    assert np.sum(~np.array(nulls)) <= 2  # 95 % are asked, of eighteen
