"""A table of heaps that another law made goes through the diagnosis unattended, within a budget of
runs: two minutes of one core. `python -m benchmarks.rates engine_tables` has the others.
"""

import pytest

from benchmarks.rates.engine_tables import (
    ATTRACTIONS,
    DEFAULT,
    NAMED,
    TOLD,
    diagnosed,
    names_in,
)
from benchmarks.rates.foreign_studies import HEAPS


@pytest.mark.long
@pytest.mark.slow
def test_of_wet_heaps_it_is_said_that_something_is_wrong(tmp_path):
    """No place but the attraction leads, and no other mechanism is named alone. Whether the name is
    found is a matter of the runs, which differ from processor to processor; how often it is, stands
    with the tables of closed forms."""
    verdict = diagnosed(tmp_path, "heaps_wet", HEAPS, DEFAULT)
    assert verdict["verdict"] in (*TOLD, "unexplained"), verdict["reason"]
    assert verdict["lack_of_fit"]["p"] < 0.05
    assert {law["slot"] for law in verdict["laws"][:1]} <= {"attraction"}
    assert verdict["verdict"] not in NAMED or names_in(verdict) <= set(ATTRACTIONS)
