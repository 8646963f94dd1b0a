"""Tables of heaps, silos, shear cells and densities that another law made go through the diagnosis
unattended, within a budget of runs.

Cost of one core: four minutes for the two tables of heaps, half an hour for all.
"""

import pytest

from benchmarks.rates.engine_tables import (
    ATTRACTIONS,
    DEFAULT,
    EXPECTED,
    NAMED,
    TABLES,
    TOLD,
    diagnosed,
    names_in,
)
from benchmarks.rates.foreign_studies import HEAPS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of the studies, which share their runs."""
    return tmp_path_factory.mktemp("foreign")


@pytest.mark.long
def test_dry_heaps_are_adequate(folder):
    verdict = diagnosed(folder, "heaps_dry", HEAPS, DEFAULT)
    assert verdict["verdict"] == "adequate", verdict["reason"]
    assert verdict["laws"] == verdict["causes"] == verdict["rows"] == verdict["errors"] == []
    assert 0 < verdict["made"] <= DEFAULT
    assert (folder / "results/heaps_dry/diagnosis/diagnosis.html").is_file()


def test_of_wet_heaps_it_is_said_that_something_is_wrong(folder):
    """No place but the attraction leads, and no other mechanism is named alone. Whether the name is
    found is a matter of the runs, which differ from processor to processor; how often it is, stands
    with the tables of closed forms."""
    verdict = diagnosed(folder, "heaps_wet", HEAPS, DEFAULT)
    assert verdict["verdict"] in (*TOLD, "unexplained"), verdict["reason"]
    assert verdict["lack_of_fit"]["p"] < 0.05
    assert {law["slot"] for law in verdict["laws"][:1]} <= {"attraction"}
    assert verdict["verdict"] not in NAMED or names_in(verdict) <= set(ATTRACTIONS)


@pytest.mark.long
@pytest.mark.parametrize("name", EXPECTED)
def test_a_table_of_engines_gets_no_wrong_name(folder, name):
    """How many are found stands on the page; one that the catalogue lacks may be missed."""
    verdict = diagnosed(folder, name, EXPECTED[name].study, DEFAULT)
    assert verdict["verdict"] not in NAMED or EXPECTED[name].met(verdict), verdict["reason"]
    assert 0 < verdict["made"] <= DEFAULT
    if EXPECTED[name].hidden == "nothing":
        assert verdict["verdict"] == "adequate"
    if "clogged" in (TABLES / f"{name}.csv").read_text():
        assert sum(row["failed"] for row in verdict["outcomes"])
        assert not any("enters no fit" in remark for remark in verdict["remarks"])
