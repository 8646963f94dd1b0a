"""A surface of which a run is lost: the opposite run of a Box-Behnken design decides alone."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import yaml

from calibration.chain.study import Study
from calibration.figures import ANGLE
from calibration.stages.response_surface import (
    plan_response_surface,
    response_surface,
    sentences,
)
from calibration.study.config import parse_config
from facts import tells
from stage_files import Files, PlanFiles

ROOT = Path(__file__).parents[2]
CENTRE = {"salt_steel_rolling_friction": 0.3, "salt_salt_restitution": 0.5}
CENTRE["salt_salt_rolling_friction"] = 0.2
NAMES = "runs coefficients anova diagnostics predicted residuals perturbation surfaces summary"


def _fitted(monkeypatch, folder, lost):
    """(design, summary) of the stage with a response that scatters and the run `lost` without."""
    monkeypatch.chdir(ROOT)
    data = yaml.safe_load(Path("config/config.yaml").read_text())
    data["response_surface"]["replicates"] = 1
    study = Study(parse_config(data))
    (folder / "ascent.json").write_text(json.dumps({"centre": CENTRE}))
    region = folder / "region.json"
    planned = SimpleNamespace(plan=PlanFiles.of(folder).plan, region=region)
    plan_response_surface(study, SimpleNamespace(ascent=folder / "ascent.json"), planned)
    rng = np.random.default_rng(4)

    def responses(table, _):
        y = 45 + 2 * table["C"] - table["E"] * table["G"] + rng.normal(0, 0.5, len(table))
        return table.assign(response=y.where(table["run"] != lost))

    monkeypatch.setattr("calibration.stages.response_surface.with_responses", responses)
    monkeypatch.setattr("calibration.chain.responses.reason_without", lambda name: "it clogged")
    files = {name: folder / f"{name}.svg" for name in NAMES.split()}
    output = Files(further={}, **files)
    source = SimpleNamespace(design=folder / "design.csv", region=region)
    response_surface(study, source, output)
    return pd.read_csv(folder / "design.csv"), json.loads(output.summary.read_text())


def test_a_lost_edge_leaves_the_opposite_run_alone(monkeypatch, tmp_path):
    design, summary = _fitted(monkeypatch, tmp_path, lost=12)
    lost = design.loc[design["run"] == 12, ["C", "E", "G"]].to_numpy()[0]
    opposite = design.loc[(design[["C", "E", "G"]].to_numpy() == -lost).all(axis=1), "run"]
    assert summary["decide_alone"] == list(opposite) == [9]
    assert summary["left_out"] == [{"run": 12, "reason": "it clogged"}]
    assert summary["statistics"]["R2_pred"] is summary["statistics"]["PRESS"] is None
    less = summary["reduced"]["statistics"]["R2_pred"]
    assert 0 < less < 1
    said = " ".join(sentences(summary, ANGLE))
    assert tells(said, "Run 9")
    assert tells(said, f"{less:.3f}")
    assert "nan" not in said
