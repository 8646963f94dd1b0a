"""The report is one file that needs nothing else, and says what the study's files say."""

import json
import re

import pandas as pd

from calibration import figures
from calibration.report import build


def study(folder):
    """A study with a validation, an optimum and a screening figure."""
    (folder / "screening").mkdir(parents=True)
    effects = pd.DataFrame({"code": ["A", "B"], "effect": [1.0, -3.0]})
    effects.to_csv(folder / "screening" / "effects.csv", index=False)
    table = effects.assign(name=["a_b", "c_d"], half_normal_score=[0.3, 1.1])
    figures.save(figures.half_normal(table, ["B"]), folder / "screening" / "half_normal.svg")
    summary = {"significant": ["c_d"], "factors": ["c_d"], "alpha": 0.05}
    (folder / "screening" / "screening.json").write_text(json.dumps(summary))
    (folder / "optimise").mkdir()
    optimum = {
        "optimum": {"c_d": 0.25},
        "solution_set": {"c_d": [0.2, 0.3]},
        "target": 45.26,
        "rule": "closest_to_centre",
    }
    (folder / "optimise" / "optimum.json").write_text(json.dumps(optimum))
    return folder


def test_the_report_needs_no_network_and_says_the_answer(tmp_path):
    build(study(tmp_path / "salt"), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "0.25" in page
    assert "0.2 to 0.3" in page
    assert "Significant at p &lt; 0.05: c d" in page
    assert "<svg" in page
    # addresses appear only as the names of XML vocabularies
    assert not re.search(r"(src|href)=.https?:", page.replace("xlink:href", "href"))
    assert "<script" not in page
    assert 'download="screening_effects.csv"' in page


def test_stages_that_have_not_run_are_left_out(tmp_path):
    build(study(tmp_path / "salt"), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert 'id="screening"' in page
    assert 'id="validation"' not in page
