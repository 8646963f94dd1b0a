"""What is made again: a task whose function imports what was edited, or that reads the section that
was changed."""

import os
import shutil

import pytest
import yaml

from calibration.digests import digest, digest_with
from calibration.study.config import overlay, parse_config
from calibration.study.stages import resolve
from workflow_rules import ROOT, rules_of

TASKS = rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)
PLANS = {name for name in TASKS if name.startswith("plan_")}
EXPORTS = {name for name in TASKS if "export" in name and name != "joint_export"}
DIAGNOSIS = {name for name in TASKS if name.startswith("diagn")}
EVERY = set(TASKS)
"""What every task imports: the schemas of run specs, and with them experiments and laws."""
EDITS = {
    # a module that is edited: the rules that run again. A file's plan and analysis go together
    "calibration/errors.py": EVERY,
    "calibration/chain/validation.py": {"plan_validation", "validation"},
    "calibration/chain/bench_tests/shear.py": {"plan_shear", "shear"},
    "calibration/runs/progress.py": set(),
    "calibration/interface/api.py": set(),
    "calibration/telling/provenance.py": {"provenance"},
    "diagnosis/verdict.schema.json": DIAGNOSIS | {"plan_disagreement", "disagreement"},
    "dem/cli.py": set(),
    "dem/contact/damping/tsuji.py": EVERY,
}
SECTIONS = [
    # a key that is changed: the rules that run again
    ("screening", "alpha", 0.1, {"plan_screening", "screening", "export"}),
    ("ascent", "steps", 6, {"plan_ascent", "screening", "export"}),
    ("scaling", "margin_deg", 1.5, {"plan_scaling", "scaling", "export"}),
    ("posterior", "draws", 60, {"posterior", "export"}),
    ("name", None, "other", {"export", "joint_export"}),
    ("runs_per_job", None, 3, {"export"}),
    ("seed", None, 5,
     PLANS | EXPORTS
     | {"tilt", "drop", "candidate", "optimise", "posterior", "joint", "joint_export"}),
]  # fmt: skip


@pytest.fixture(scope="module")
def data():
    data = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    # the ends of the desirability, which a further target needs, and a rig, which a target names
    more = {"target": {"low": 20.0, "high": 70.0}, "rigs": {"pour": {"experiment": "heap"}}}
    return overlay(data, more)


@pytest.fixture(scope="module")
def config(data):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return parse_config(data)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("copy") / "src"
    shutil.copytree(ROOT / "src", folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def digests(config, sources=ROOT / "src"):
    """{rule: digest} as rules/common.smk makes it."""
    return {
        name: digest(
            config, task.reads, [task.function.split(":")[0], "calibration.chain.study"], sources
        )
        for name, task in TASKS.items()
    }


@pytest.fixture(scope="module")
def before(config, sources):
    return digests(config, sources)


@pytest.mark.parametrize("module", EDITS)
def test_an_edited_module_makes_stale_what_imports_it(module, config, sources, before):
    path = sources / module
    text = path.read_text()
    edit = '{"a": 1}' if module.endswith(".json") else text + "\nEDITED = True\n"
    path.write_text(edit)
    after = digests(config, sources)
    path.write_text(text)
    stale = {name for name in TASKS if after[name] != before[name]}
    assert stale == EDITS[module]


def test_packages_beside_the_projects_own_count_for_nothing(config, sources, before, tmp_path):
    """In a wheel's environment all packages lie in one folder, and some take names of their own."""
    site = shutil.copytree(sources, tmp_path / "site-packages")
    (site / "numpy").mkdir()
    (site / "numpy/__init__.py").write_text("from numpy import array, linalg\n")
    assert digests(config, site) == before


def test_comments_and_docstrings_make_nothing_stale(config, sources, before):
    path = sources / "calibration/chain/screening.py"
    text = path.read_text()
    path.write_text(
        text.replace("Screening: which factors matter", "Other words") + "\n# a remark\n"
    )
    after = digests(config, sources)
    path.write_text(text)
    assert after == before


@pytest.mark.parametrize(("section", "key", "value", "expected"), SECTIONS)
def test_a_changed_key_makes_stale_what_reads_its_section(
    section, key, value, expected, data, before, sources
):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        changed = parse_config(overlay(data, {section: {key: value} if key else value}))
    after = digests(changed, sources)
    assert {name for name in TASKS if after[name] != before[name]} == expected


def test_every_section_of_the_configuration_is_read_by_a_stage_or_stands_for_its_files(config):
    read = {section for name, task in TASKS.items() if name != "export" for section in task.reads}
    # where files are, which pages wait for which stage, and what only the written-out study has
    files = {"name", "results", "supplements", "fixed_from", "published", "engine", "resolution"}
    # how runs are shared among processes decides none of them
    files |= {"runs_per_job"}
    assert set(type(config).model_fields) == read | files


def test_every_declared_function_exists_and_bears_the_rule_s_name():
    for name, task in TASKS.items():
        assert task.function.endswith(f":{name}")
        assert callable(resolve(task.function))


def test_a_table_counts_by_what_is_in_it(tmp_path):
    table = tmp_path / "factors.tsv"
    found = {digest_with("code", [table])}
    table.write_text("1")
    found.add(digest_with("code", [table]))
    os.utime(table, (1.0, 1.0))
    assert digest_with("code", [table]) in found
    table.write_text("2")
    found.add(digest_with("code", [table]))
    assert len(found) == 3
