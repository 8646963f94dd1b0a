"""LIGGGHTS itself, where it is installed: its contacts beside ours, and its recorded results.

`pytest tests/verification/test_cross_engine_live.py -n 0 -m peer --record-peers` runs every case
and every seed and writes the tables in tests/verification/liggghts, which test_cross_engine.py
holds against this engine without LIGGGHTS.
"""

import numpy as np
import pandas as pd
import pytest
from liggghts import cases, peer, records

from other_codes import entry_or_skip

pytestmark = pytest.mark.peer


@pytest.fixture(autouse=True)
def _installed():
    entry_or_skip("liggghts")


@pytest.fixture
def recording(request):
    return request.config.getoption("--record-peers")


def same(table, recorded):
    """Numbers that one contact determines are the same wherever LIGGGHTS runs."""
    for name in table["case"].unique():
        for now, then in zip(
            records.of_case(table, name), records.of_case(recorded, name), strict=True
        ):
            np.testing.assert_allclose(now, then, rtol=1e-6, atol=1e-6 * np.abs(then).max())


def test_contacts(tmp_path, recording):
    rows = []
    for name in cases.CONTACTS:
        sim, width, law, parameters = cases.contacts(name)
        version, states = peer.run_pairs(sim, width, tmp_path, law, parameters, 1)
        rows.append(records.contact_rows(name, *peer.vectors(states[0], "f", "tq")))
    table = pd.concat(rows)
    if recording:
        records.write("contacts", table, version)
    same(table, records.read("contacts"))


def test_impacts(tmp_path, recording):
    rows = []
    for name in cases.IMPACTS:
        sim, width, law, parameters = cases.impacts(name)
        version, states = peer.run_pairs(sim, width, tmp_path, law, parameters, cases.IMPACT_STEPS)
        rows.append(records.impact_rows(name, *peer.vectors(states[-1], "v", "omega")))
    table = pd.concat(rows)
    if recording:
        records.write("impacts", table, version)
    same(table, records.read("impacts"))


@pytest.mark.slow
def test_beds(tmp_path, recording):
    """Recorded: all seeds. Otherwise one bed, which must lie among the recorded ones."""
    rows = []
    for seed in cases.SEEDS if recording else cases.SEEDS[:1]:
        sim, width = cases.bed(seed, **cases.BED)
        version, state = peer.run_bed(sim, width, tmp_path, cases.BED["steps"])
        rows.append({"seed": seed} | cases.measure_bed(cases.state_of(state), width))
    if recording:
        records.write("beds", rows, version)
    among(rows[0], records.read("beds"), ("height_mm", "packing_fraction", "coordination"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "seed"),
    [(case, seed) for case in cases.HEAPS for seed in cases.PRIMES]
    + [("elastic-plastic, 0.46", seed) for seed in cases.MORE_PRIMES],
)
def test_heaps(tmp_path, recording, case, seed):
    if not recording:
        pytest.skip("a heap takes LIGGGHTS minutes: run with --record-peers")
    spec = cases.heap_spec(*cases.HEAPS[case], 1)
    version, state = peer.run_heap(spec, tmp_path, seed, cases.HEAP_TIME)
    final = cases.state_of(state)
    row = {"case": case, "seed": seed} | cases.measure_pile(final, spec)
    records.add_heap(row, final[0], version)
    assert row["in_funnel"] == 0


def among(row, recorded, names):
    """A single run lies within four standard deviations of the recorded ones, or as near as these
    numbers resolve."""
    for name in names:
        mean, spread = recorded[name].mean(), recorded[name].std()
        assert abs(row[name] - mean) <= max(4.0 * spread, 1e-3 * mean), name
