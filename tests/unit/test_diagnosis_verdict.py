"""The stages of the diagnosis on runs that are closed forms: the shipped case, its verdict and its
schema."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_cases import bench, closed_form, concluded, files, setup_of

from diagnosis import setup, stages
from diagnosis.bulk import Bulk
from diagnosis.measurements import Measured, read_all
from diagnosis.verdict import extension, findings, validate

SHIPPED = "data/paper/measurements.csv"
KINDS = ["heap", "tilt", "drop", "shear"]
CHANGES = {
    "experiments": {
        "drop": {"mechanisms": ["air_drag"]},
        "tilt": {"mechanisms": []},
        "heap": {"mechanisms": ["cohesion"]},
        "shear": {"mechanisms": ["cohesion"]},
    }
}


@pytest.fixture(scope="module")
def emulated():
    return bench(KINDS, CHANGES)


def shear_of(measured, intercept, slope=0.845):
    """The measured conditions with a yield locus of eight loads, each known to 2 % by five
    replicates."""
    others = [m for m in measured if m.experiment != "shear"]
    stress = {s: intercept + slope * s for s in np.arange(1.0, 9.0)}
    one = next(m for m in measured if m.experiment == "shear")
    return others + [
        replace(one, value=v, sd=0.02 * v, n=5, levers={"normal_stress_kPa": float(s)})
        for s, v in stress.items()
    ]


def diagnose(emulated, measured):
    bulk = Bulk(emulated, measured)
    found = bulk.judged(seed=2)
    return findings(bulk, found, extension(bulk, found), 0.05)


def test_without_an_intercept_nothing_is_missing(emulated):
    found = diagnose(emulated, shear_of(read_all(SHIPPED).fitted, 0.0))
    assert found["verdict"] == "adequate"
    validate(found)


def test_an_intercept_alone_leaves_cohesion_and_an_uncounted_load_in_question(emulated):
    found = diagnose(emulated, shear_of(read_all(SHIPPED).fitted, 0.084))
    validate(found)
    assert found["verdict"] == "ambiguous"
    [law] = found["laws"]
    assert [law["slot"], *(r["slot"] for r in law["rivals"])] == ["attraction", "load"]
    further = found["next_measurement"]
    assert further["experiment"] == "heap"  # the shear cell's weights change no heap
    assert further["information_bits"] > 0.1
    assert set(further["predictions"]) == {"cohesion", "uncounted_load"}


def test_every_stage_writes_what_the_next_one_reads(emulated, tmp_path, monkeypatch):
    """From trained emulators to verdict.json and its figures; closed forms replace the engine."""
    measured = shear_of(read_all(SHIPPED).fitted, 0.084)
    monkeypatch.setattr(setup, "read_all", lambda path: Measured(measured, [], []))
    for module in (stages, setup):
        monkeypatch.setattr(
            module, "simulate", lambda specs: {k: closed_form(s) for k, s in specs.items()}
        )
    settings = emulated.settings
    at = tmp_path.joinpath

    plan = files(tmp_path, design="design.json", plan="plan.json")
    own = setup_of(SHIPPED, settings)
    stages.plan_runs(own, plan)
    trained = SimpleNamespace(designs=[plan.design], plans=[plan.plan])
    for k in (1, 2):
        wave = files(
            tmp_path, design=f"design_{k}.json", plan=f"plan_{k}.json", left=f"left_{k}.json"
        )
        stages.plan_refinement(own, trained, wave)
        trained.designs.append(wave.design)
        trained.plans.append(wave.plan)
    trained.left = [at("left_1.json"), at("left_2.json")]
    verdict = concluded(own, trained, tmp_path)
    assert verdict["gain"]["settings"] == len(measured)
    assert verdict["gain"]["held_out_rmse_after"] < verdict["gain"]["held_out_rmse_before"]
    told = {c["lever"]: c for c in verdict["discrepancy"] if c["experiment"] == "shear"}
    assert told["normal_stress_kPa"]["value"][0] > told["normal_stress_kPa"]["value"][-1]
    assert verdict["extended_with"] == [verdict["ranking"][0]["mechanism"]]
    table = np.genfromtxt(at("residuals.csv"), delimiter=",", names=True, dtype=None)
    assert len(table) == len(measured)
    for figure in ("residuals", "ranking", "gain"):
        assert at(f"{figure}.svg").read_text().count("<svg") == 1
    text = at("diagnosis.md").read_text()
    assert f"**Verdict: {verdict['verdict']}" in text
    refinement = verdict["refinement"]
    assert [w["wave"] for w in refinement["waves"]] == [1, 2]
    assert {r["experiment"] for r in refinement["left"]} == {m.experiment for m in measured}
    assert re.search(r"^## .*emulators", text, re.M)
    html = at("diagnosis.html").read_text()
    assert html.count("<svg role=") == 3  # residuals, ranking and gain
    assert html.count("<table") == sum(line.startswith("|---") for line in text.splitlines())
    assert not re.search(r"(src|href|url\()=?.https?:", html.replace("xlink:href", "href"))
    assert not re.search(
        r"\||\*\*", re.sub(r"<style.*?</style>|<svg.*?</svg>", "", html, flags=re.S)
    )
