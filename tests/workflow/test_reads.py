"""The page opens no result that its rule does not declare, and an edited deck is told.

What another stage reads of the configuration, or touches, without a word in its rule is refused
where it is called: by `Declared.call` here, and in the jobs of the test profile, which `.ci/run`
makes.
"""

from pathlib import Path
from types import SimpleNamespace

import pytest

from calibration.chain.jobs import leave_record
from calibration.chain.study import Study
from calibration.runs.records import altered
from calibration.study.stage import load_stages
from calibration.telling.report import build
from opened.watch import undeclared, watching
from workflow.test_targets import angle, run_chain, study
from workflow_rules import flat, read_workflow, rules_of


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
        build(study.folder, rule.output[0], load_stages(), study.config.target.metric)
    assert undeclared(seen, [*declared, *rule.output]) == []
    assert any(path.endswith("effects.csv") for path in seen)


@pytest.mark.slow
def test_an_edited_deck_is_told(exported):
    study, data = exported
    output = flat(rules_of(data)["export"].output)
    job = SimpleNamespace(input=[], output=output, log=["export.log"])
    leave_record(SimpleNamespace(**vars(job), params=SimpleNamespace(made_from="")), study)
    assert list(altered(study.folder)) == []
    deck = Path(study.folder, "exports/lammps/in.lammps")
    deck.write_text(deck.read_text() + "# mine\n")
    assert list(altered(study.folder)) == [("export", deck)]
