"""What a plan of heaps and shear cells would show, by emulators."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_cases import bench

from calibration.intake.measurements import Measurement
from diagnosis import stages
from diagnosis.bulk import Bulk
from diagnosis.power import POWER, _Bench, of_bulk, page
from diagnosis.table_model.selection import SPENT
from facts import rows_in

CHANGES = {
    "experiments": {
        "shear": {"mechanisms": ["cohesion", "stress_dependent_friction"]},
        "heap": {"mechanisms": ["cohesion"]},
    }
}
LOADS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)


def plan(share=0.02):
    """Guesses: shear stresses 0.8 of the load, and a heap of 40 degrees."""
    rows = [
        Measurement("shear", 0.8 * x, 0.8 * x * share, 5, {"normal_stress_kPa": x}) for x in LOADS
    ]
    return [*rows, Measurement("heap", 40.0, 100.0 * share, 5, {})]


@pytest.fixture(scope="module")
def emulated():
    return bench(["shear", "heap"], CHANGES)


@pytest.fixture(scope="module")
def rows(emulated):
    return {r["law"]: r for r in of_bulk(Bulk(emulated, plan()))}


@pytest.mark.slow
def test_every_mechanism_of_the_plan_has_a_row(emulated, rows):
    assert set(rows) == {"cohesion", "uncounted_load"}  # the others change nothing here
    assert rows["cohesion"]["experiment"] == "shear and heap"
    assert rows["cohesion"]["share"] >= POWER
    text = page(list(rows.values()))
    assert rows_in(text)["shear and heap"][:2] == ["cohesion", "surface energy"]


def test_what_is_not_there_alarms_as_seldom_as_stated(emulated):
    bulk = Bulk(emulated, plan())
    [block] = bulk.at(bulk.fitted.predicted[0]).block().values()
    tried = _Bench(block, 0.05 * SPENT[0], 1)
    # 3.5 % are stated; 12 of 99 have a chance of 0.1 %
    assert tried.shown(np.zeros(len(plan())))[0] <= 0.11


def test_the_stage_reads_emulators_and_writes_its_page(emulated, tmp_path):
    own = SimpleNamespace(
        of_contacts=False, emulated=lambda designs, plans: (emulated, []), measurements=plan(0.1),
        settings=emulated.settings,
    )  # fmt: skip
    output = SimpleNamespace(power=tmp_path / "power.json", page=tmp_path / "power.md")
    stages.plan_power(own, SimpleNamespace(designs=(), plans=()), output)
    assert "cohesion" in output.page.read_text()
    assert "cohesion" in output.power.read_text()
