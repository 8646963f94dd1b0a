"""A table of drops alone goes through every stage without a run of the engine's experiments."""

import json
import types

import numpy as np
import pytest
from diagnosis_cases import BASE, FACTORS

from diagnosis import setup, stages
from diagnosis.settings import read_settings
from diagnosis.verdict import validate


@pytest.fixture
def table(tmp_path):
    """Thirty rebounds whose restitution falls by 0.08 for each m/s, 1 % scatter of the means."""
    rng = np.random.default_rng(3)
    rows = ["experiment,quantity,value,unit,sd,n,drop_height_mm,particle_diameter_mm"]
    for h in (30, 60, 100, 160, 250, 400):
        for d in (1.0, 1.5, 2.0, 3.0, 4.0):
            speed = np.sqrt(2e-3 * 9.81 * h)
            value = h * (0.8 - 0.08 * speed) ** 2 * (1.0 + 0.01 * rng.standard_normal())
            rows.append(f"drop,rebound_height,{value:.4f},mm,{0.0224 * value:.4f},5,{h},{d}")
    path = tmp_path / "drops.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_thirty_rows_of_single_grains_get_a_law(table, tmp_path):
    config = types.SimpleNamespace(
        experiment="heap", measurements=str(table), factors=FACTORS, run=BASE
    )
    # the engine's own contacts are tested elsewhere
    settings = read_settings("config/diagnosis.yaml", {"replicates": 99})
    known = {n: m for n, m in setup.catalogue_of(settings, ["drop"]).items() if m.observe}
    own = setup.Setup(types.SimpleNamespace(config=config), settings)

    def files(**names):
        return types.SimpleNamespace(**{k: str(tmp_path / v) for k, v in names.items()})

    plan = files(design="design.json", plan="plan.json")
    stages.plan_runs(own, plan)
    assert json.loads((tmp_path / "plan.json").read_text()) == {}
    trained = files(emulators="e.npz", errors="e.json")
    stages.emulate(own, plan, trained)
    stages.calibrate(own, trained, files(summary="c.json", table="r.csv", residuals="r.svg"))
    named = files(
        findings="f.json", extension="x.json", plan="xp.json",
        predictions="p.svg", ranking="k.svg",
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(own, "catalogue", known)
        stages.name_causes(own, trained, named)
    end = files(
        verdict="verdict.json", page="diagnosis.md", alone="diagnosis.html", gain="gain.svg"
    )
    stages.conclude(own, named, end)
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    validate(verdict)
    law = verdict["law"]
    assert verdict["verdict"] == "discovered"
    assert (law["slot"], law["state"]) == ("restitution", ["speed"])
    for point in law["values"]:
        assert point["low"] <= 0.8 - 0.08 * point["state"] <= point["high"]
    assert law["held_out"]["after"] < 0.5 * law["held_out"]["before"]
    assert "restitution falls from" in (tmp_path / "diagnosis.md").read_text()
