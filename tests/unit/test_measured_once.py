"""What was measured stands once, and one reader reads all tables."""

import re
from pathlib import Path

import pytest

from calibration import Study
from calibration.intake.measurements import read_measured
from calibration.stages.bench_tests import measured
from calibration.stages.shear import measured_locus
from diagnosis.measurements import read_measurements

ROOT = Path(__file__).parents[2]
TABLE = "data/paper/measurements.csv"
KINDS = (".csv", ".tsv", ".yaml", ".py")


def lines_with(number):
    """Lines of configuration, the paper's tables and sources that hold a number of its own."""
    found = []
    for folder in ("config", "data/paper", "src", "workflow", "profiles"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in KINDS and "__pycache__" not in path.parts:
                text = path.read_text(encoding="utf-8")
                pattern = rf"(?<![\d.]){re.escape(number)}(?![\d])"
                hits = [line for line in text.splitlines() if re.search(pattern, line)]
                found += [(path.relative_to(ROOT).as_posix(), line) for line in hits]
    return found


@pytest.mark.parametrize("number", ["35.82", "20.5", "1.774", "3.464", "5.154", "6.844"])
def test_a_measured_value_of_the_salt_stands_once(number):
    [(path, _)] = lines_with(number)
    assert path == TABLE


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
