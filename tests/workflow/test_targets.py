"""The chain from screening to validation with many factors and replicates; and its page opens no
result that its rule does not declare.

The runs are answered by formulas in place of the engine, so that the right outcome is known.
"""

from pathlib import Path
from types import SimpleNamespace

import pytest

from calibration.chain.jobs import leave_record
from calibration.chain.study import Study
from calibration.runs.plans import read_plan
from calibration.runs.verify import faults_of
from calibration.study.config import parse_config
from calibration.study.stage import load_stages
from calibration.telling.report.build import build
from made_up import HEAP, answer
from opened.watch import undeclared, watching
from workflow_rules import flat, read_workflow, rules_of

CHAIN = {
    "screening": ("plan_screening", "screening"),
    "ascent": ("plan_ascent", "ascent"),
    "response_surface": ("plan_response_surface", "response_surface"),
    "optimise": ("candidate", "plan_candidate_first", "plan_candidate", "optimise"),
    "validation": ("plan_validation", "validation"),
}
"""The rules of each stage of the chain, in their order."""
KEYS = (
    "contacts.particle_particle.rolling_friction",
    "contacts.particle_wall.rolling_friction",
    "contacts.particle_particle.static_friction",
    "contacts.particle_wall.static_friction",
    "contacts.particle_particle.restitution",
    "contacts.particle_wall.restitution",
    "materials.particle.poisson_ratio",
    "materials.wall.poisson_ratio",
    "materials.particle.density_kg_m3",
    "materials.particle.shear_modulus_Pa",
    "materials.wall.density_kg_m3",
)
LEVELS = {"density_kg_m3": (1000.0, 3000.0), "shear_modulus_Pa": (1e6, 1e7)}


def write_factors(path, count):
    rows = ["code\tname\tkey\tlow\thigh"]
    for n, key in enumerate(KEYS[:count]):
        low, high = LEVELS.get(key.split(".")[-1], (0.1, 0.4))
        rows.append(f"{chr(65 + n)}\tf{n + 1}\t{key}\t{low}\t{high}")
    path.write_text("\n".join(rows) + "\n")


def levels_of(spec, count):
    """Coded levels of the factors in a spec; 0 where a stage leaves a factor at the default."""
    found = []
    for key in KEYS[:count]:
        part = spec
        for name in key.split("."):
            part = part.get(name, {})
        if part == {}:
            found.append(0.0)
            continue
        low, high = LEVELS.get(key.split(".")[-1], (0.1, 0.4))
        found.append((part - 0.5 * (low + high)) / (0.5 * (high - low)))
    return found


def run_stage(name, config, count, metrics, rules=None):
    """The rules of a stage called as the workflow does; runs are answered by formulas. Returns the
    stage's summary."""
    study, rules = Study(config), rules or rules_of(config.model_dump(mode="json"))

    def noisy(spec, rng):
        x = levels_of(spec, count)
        return {m: float(f(*x) + 0.05 * rng.standard_normal()) for m, f in metrics.items()}

    for rule in CHAIN[name]:
        rules[rule].call(study)
        if rules[rule].plan:
            answer(rules[rule].plan, noisy, wall_time_s=1.0)
    return study.summary(name)


def run_chain(config, count, metrics):
    """The stages as the workflow calls them; returns their summaries."""
    rules = rules_of(config.model_dump(mode="json"))
    return {name: run_stage(name, config, count, metrics, rules) for name in CHAIN}


def write_measured(measured):
    """Three readings of each metric."""
    rows = ["experiment,quantity,value,unit,drop_height_mm"]
    for metric, mean in measured.items():
        name, _, unit = metric.rpartition("_")
        experiment, height = ("drop", 150) if name == "rebound_height" else ("heap", "")
        values = [mean + shift for shift in (-0.4, 0.0, 0.4)]
        rows += [f"{experiment},{name},{value},{unit},{height}" for value in values]
    Path("measured.csv").write_text("\n".join(rows) + "\n")


def study(tmp_path, monkeypatch, count, measured, **more):
    monkeypatch.chdir(tmp_path)
    write_factors(Path("factors.tsv"), count)
    write_measured(measured)
    first = next(iter(measured))
    data = {
        "name": "made-up",
        "factors": "factors.tsv",
        "measurements": "measured.csv",
        "tests": {"heap": {"experiment": "drop" if first.startswith("rebound") else "heap"}},
        "calibrate": {"to": first},
        "run": HEAP,
        "ascent": {"rule": "effects"},
        "response_surface": {"half_width": {"f1": 0.05, "f2": 0.05, "f3": 0.05}},
        "validation": {"groups": 2, "replicates": 3},
    }
    return parse_config(data | more)


def angle(a, b, c, *others):
    return 35.0 + 6.0 * a + 4.0 * b + 3.0 * c + 0.5 * a * a


@pytest.mark.slow
@pytest.mark.parametrize(("count", "runs"), [(4, 8), (11, 32)])
def test_four_to_eleven_factors_are_screened_and_calibrated(tmp_path, monkeypatch, count, runs):
    config = study(tmp_path, monkeypatch, count, {"angle_of_repose_deg": 36.0})
    found = run_chain(config, count, {"angle_of_repose_deg": angle})
    assert len(read_plan("results/made-up/screening/plan.json")) == runs + 3
    assert found["screening"]["factors"] == ["f1", "f2", "f3"]
    assert found["optimise"]["attainable"]
    assert found["validation"]["simulated_mean"] == pytest.approx(36.0, abs=0.15)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A study of the chain that formulas answer, with its export; and its rules."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("study")
        config = study(folder, patch, 4, {"angle_of_repose_deg": 36.0}, fixed={"f4": 0.3})
        run_chain(config, 4, {"angle_of_repose_deg": angle})
        data = config.model_dump(mode="json")
        rules_of(data)["export"].call(Study(config))
        yield Study(config), data


@pytest.mark.slow
def test_the_page_opens_what_its_rule_declares(exported):
    study, data = exported
    [rule] = [rule for rule in read_workflow(data).rules if rule.name == "report"]
    files = [f(None) if callable(f) else f for f in rule.input]
    declared = [p for one in files for p in (one if isinstance(one, list) else [one])]
    with watching() as seen:
        build(study.folder, rule.output[0], load_stages(), study.config.target)
    assert undeclared(seen, [*declared, *rule.output]) == []
    assert any(path.endswith("effects.csv") for path in seen)


@pytest.mark.slow
def test_an_edited_deck_is_told(exported):
    study, data = exported
    output = flat(rules_of(data)["export"].output)
    job = SimpleNamespace(input=[], output=output, log=["export.log"])
    leave_record(SimpleNamespace(**vars(job), params=SimpleNamespace(made_from="")), study)
    assert faults_of(study.folder.parent) == []
    deck = Path(study.folder, "exports/lammps/in.lammps")
    deck.write_text(deck.read_text() + "# mine\n")
    assert [fault.file for fault in faults_of(study.folder.parent)] == [deck]
