"""What was measured comes from one table, and one reader reads all tables."""

from pathlib import Path

import pytest

from calibration import Study
from calibration.intake.measurements import read_measured
from calibration.stages.bench_tests import measured
from calibration.stages.shear import measured_locus
from diagnosis.measurements import read_measurements

ROOT = Path(__file__).parents[2]
TABLE = "data/paper/measurements.csv"


def test_target_bench_tests_and_diagnosis_take_their_values_from_the_one_table(monkeypatch):
    monkeypatch.chdir(ROOT)
    study = Study("config/config.yaml")
    assert study.config.measurements == TABLE
    heap, *_ = read_measured(TABLE).of("heap", "angle_of_repose")
    assert list(study.measured()) == list(heap.readings)
    assert (measured(study, "tilt"), measured(study, "drop")) == (35.82, 20.5)
    assert measured_locus(study.config) == (0.845, 0.084)
    diagnosed = {m.experiment: m for m in read_measurements(TABLE)}
    assert diagnosed["heap"].value == pytest.approx(study.measured().mean(), rel=1e-15)
    assert diagnosed["heap"].sd == pytest.approx(study.measured().std(ddof=1), rel=1e-12)
    assert diagnosed["tilt"].value == measured(study, "tilt")
