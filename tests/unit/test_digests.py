"""What is made again: a task whose function imports what was edited, or that reads the section that
was changed."""

import os
import shutil

import pytest
import yaml

from calibration.digests import digest, digest_with, modules
from calibration.study.config import overlay, parse_config
from calibration.study.stages import resolve
from workflow_rules import ROOT, rules_of

TASKS = rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)
PLANS = {name for name in TASKS if name.startswith("plan_")}
CHAIN = {"screening", "ascent", "response_surface", "candidate", "optimise", "validation"}
HEAPS = {
    "plan_screening",
    "plan_ascent",
    "plan_response_surface",
    "plan_candidate_first",
    "plan_candidate",
    "plan_validation",
}
CANDIDATE = {"plan_candidate_first", "plan_candidate"}
EXPORTS = {
    "export",
    "export_rolling",
    "export_converted",
    "plan_export_scan",
    "plan_export_confirmation",
    "plan_export_correction",
}
TILT = {"plan_tilt", "plan_tilt_confirmation", "tilt"}
DROP = {"plan_drop", "plan_drop_confirmation", "drop"}
SWEEPS = TILT | DROP | {"bench_parameters"}
SHEAR, SCALING = {"plan_shear", "shear"}, {"plan_scaling", "scaling"}
STARTS = {"plan_tilt", "plan_drop"}
NUMERICS, DISAGREEMENT = {"plan_numerics", "numerics"}, {"plan_disagreement", "disagreement"}
PAPER = {"audit", "reproduction"}
DIAGNOSIS = {name for name in TASKS if name.startswith("diagn")}
JOINT = {"plan_joint_first", "plan_joint", "joint"}
PUSHED = {f"{p}{s}push_through" for p in ("", "plan_") for s in ("", "joint_")}
POURED = {"plan_pour_rate", "pour_rate"}
EVERY = set(TASKS)
"""What every task imports: the schemas of run specs, and with them experiments and laws."""
FOREIGN = (
    EVERY
    - CHAIN
    - HEAPS
    - NUMERICS
    - PUSHED
    - POURED
    - JOINT
    - PAPER
    - {"posterior", "provenance", "heaps"}
)
"""What may run another code."""
EDITS = {
    # a module that is edited: the rules that run again. A file's plan and analysis go together
    "calibration/errors.py": EVERY,
    "calibration/chain/joint/analysis.py": {"joint", "joint_export"},
    "calibration/chain/joint/laboratory_hours.csv": JOINT
    | {"plan_joint_push_through", "joint_push_through", "joint_export"},
    "calibration/chain/validation.py": {"plan_validation", "validation"},
    "calibration/chain/bench_tests/shear.py": SHEAR,
    "calibration/chain/scaling/probe.py": {"scaling"},
    "calibration/statistics/screening.py": {"plan_screening", "screening"} | PAPER,
    "calibration/telling/export/mercurydpm.py": EXPORTS | {"joint_export"},
    "calibration/engines/yade.j2": FOREIGN,
    "calibration/figures/optimum.py": None,
    "calibration/inference/joint/critique.py": JOINT | {"joint_export"},
    "calibration/inference/posterior_sampling.py": {"posterior", "joint_export"} | JOINT,
    "calibration/intake/measurements.py": EVERY,
    "calibration/intake/sound.py": set(),
    "calibration/interface/api.py": set(),
    "calibration/runs/plans.py": EVERY,
    "calibration/runs/progress.py": set(),
    "calibration/study/factors.py": EVERY,
    "calibration/telling/export/rolling.py": EXPORTS | {"joint_export"},
    "calibration/telling/provenance.py": {"provenance"},
    "diagnosis/page/markdown.py": DIAGNOSIS,
    "diagnosis/verdict.py": DIAGNOSIS,
    "diagnosis/verdict.schema.json": DIAGNOSIS | DISAGREEMENT,
    "diagnosis/switched_causes.py": DISAGREEMENT,
    "diagnosis/catalogue/air_drag.py": DIAGNOSIS | DISAGREEMENT,
    "paper/audit/bench.py": PAPER,
    "paper/reproduction/chain.py": PAPER | DISAGREEMENT,
    "paper/reference.py": set(),
    "paper/release/parts.py": set(),
    "calibration/inference/joint/likelihood.py": JOINT | {"joint_export"},
    "calibration/chain/study.py": EVERY,
    "calibration/study/config/measured.py": EVERY,
    "calibration/engines/lammps.py": FOREIGN,
    "calibration/engines/rigs/discharge.py": FOREIGN,
    "calibration/study/new/heap.py": set(),
    "calibration/study/new/methods/declare.py": set(),
    "calibration/intake/photo/measure.py": set(),
    "calibration/telling/report/plain.py": DIAGNOSIS,  # which write a page of their own
    "calibration/study/stages/numerics.py": set(),
    "calibration/intake/tables.py": EVERY,
    "dem/tables/table.py": EVERY,
    "diagnosis/table_model/selection.py": DIAGNOSIS | DISAGREEMENT,
    "diagnosis/table_model/terms/rows.py": DIAGNOSIS | DISAGREEMENT,
    "diagnosis/laws/slots.py": DIAGNOSIS | DISAGREEMENT,
    "dem/cli.py": set(),
    "dem/contact/damping/tsuji.py": EVERY,
    "dem/experiments/drum.py": EVERY,
    "dem/io/files.py": EVERY,
    "dem/measure/heap.py": EVERY,
    "dem/render/image.py": {"heaps", "joint_export"} | EXPORTS,  # where the plate of a heap ends
    "dem/walls/builder.py": EVERY,
}
SECTIONS = [
    # a key that is changed: the rules that run again
    ("validation", "margin", 2.0, {
        "plan_validation", "validation", "candidate", "optimise", "export", "export_rolling",
        "plan_export_correction",
    }),
    ("screening", "alpha", 0.1, {"plan_screening", "screening", "export"}),
    ("ascent", "steps", 6, {"plan_ascent", "screening", "export"}),
    ("response_surface", "centre_runs", 6,
     {"ascent", "plan_response_surface", *CANDIDATE, "export"}),
    ("optimise", "candidate_runs", 9, CANDIDATE | {"candidate", "optimise", "export"}),
    ("bench", "shear", {"replicates": 5},
     TILT | DROP | SHEAR | DIAGNOSIS | {"export", "plan_disagreement"}),
    ("scaling", "margin_deg", 1.5, SCALING | {"export"}),
    ("measurements", None, "examples/soybean/measured.csv",
     {"screening", "ascent", "response_surface", "candidate", "optimise", "validation"}
     | {"posterior", "push_through", "export", "shear", "provenance", "plan_joint", "joint"}
     | {"joint_push_through"}
     | {n for n in TILT | DROP if n not in STARTS} | DIAGNOSIS),
    ("numerics", None, "other.yaml", {"plan_numerics", "export"}),
    ("diagnosis", "alpha", 0.1, DIAGNOSIS | {"export", "disagreement"}),
    ("push_through", "drum", {"experiment": "drum"},
     PUSHED | {"export"} | DIAGNOSIS),
    ("pour_rate", None, {"rates_per_s": [1.0, 2.0]}, {"plan_pour_rate", "pour_rate", "export"}),
    ("posterior", "draws", 60, {"posterior", "export"}),
    ("rigs", "vessel", {"experiment": "bulk_density"}, JOINT | {"export", "export_converted"}),
    ("targets", None, [{"rig": "pour", "metric": "angle_of_repose_deg"}],
     {"plan_joint", "joint", "export", "export_converted"}),
    ("joint", "runs", 40, JOINT | {"export", "joint_export"}),
    ("published", "names", {"particles.count": "other"}, {"export", "joint_export"}),
    ("target", "low", 30.0, CHAIN | EXPORTS | {"plan_candidate", "numerics", "posterior",
     "pour_rate", "provenance"}),
    ("seed", None, 5,
     PLANS | EXPORTS
     | {"tilt", "drop", "candidate", "optimise", "posterior", "joint", "joint_export"}),
    ("name", None, "other", {"export", "joint_export"}),
    ("supplements", None, ["tilt"], {"export"}),
    ("results", None, "other", {"export"}),
    ("runs_per_job", None, 3, {"export"}),
    ("fixed_from", None, "bench", {"export", "joint_export"}),
    ("factors", None, "./config/factors.tsv",
     # the analyses have the factors in their design
     EVERY - {"response_surface", "candidate", "optimise", "validation", "posterior", "scaling",
              "pour_rate", "push_through", "numerics", "bench_parameters", "audit", "heaps"}),
    ("fixed", "salt_poisson_ratio", 0.3,
     HEAPS | EXPORTS | TILT | DROP | SHEAR
     | {"plan_scaling", "plan_numerics", "plan_pour_rate"} | DISAGREEMENT
     | {"plan_push_through", "plan_joint_push_through"}
     | (JOINT - {"joint"}) | {"joint_export"}
     | DIAGNOSIS),
    ("run", "numerics", {"rayleigh_fraction": 0.3},
     EVERY - {"audit", "bench_parameters", "heaps", "numerics", "provenance"}),
    ("resolution", None, "quick",
     EVERY - {"audit", "bench_parameters", "heaps", "numerics", "provenance"}),
    ("further_targets", None, [{"metric": "height_mm", "goal": "maximise", "low": 1.0, "high": 90}],
     CHAIN | {"plan_candidate", "posterior", "export"}),
]  # fmt: skip
WHOLE = {"experiment", "engine"}
"""Sections that nothing can change alone: another experiment has another geometry and other
targets, and another engine becomes part of `run`."""


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
    if EDITS[module] is None:  # figures come as one package: every stage that draws
        drawing = CHAIN | {"tilt", "drop", "shear", "scaling", "numerics"}
        assert drawing <= stale
        assert not stale & {"audit"}
    else:
        assert stale == EDITS[module]


def folders(package):
    """Folders of modules below `src`."""
    files = (ROOT / "src" / package).rglob("*.py")
    return {
        p.parent.relative_to(ROOT / "src").as_posix()
        for p in files
        if p.stem.isidentifier() and p.stem != "__init__"
    }


def test_what_a_law_says_of_other_codes_makes_the_exports_stale(config, sources, before):
    path = sources / "dem/contact/cohesion/sjkr.py"
    text = path.read_text()
    path.write_text(text.replace('words="cohesion sjkr2"', 'words="cohesion sjkr"'))
    after = digests(config, sources)
    path.write_text(text)
    assert all(after[name] != before[name] for name in EXPORTS)


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


@pytest.mark.parametrize("name", TASKS)
def test_every_declared_function_exists_and_bears_the_rule_s_name(name):
    assert TASKS[name].function.endswith(f":{name}")
    assert callable(resolve(TASKS[name].function))


def test_a_task_depends_on_its_module_and_not_on_the_workflow():
    found = modules("calibration.chain.screening")
    assert ROOT / "src/calibration/chain/screening.py" in found
    assert ROOT / "src/calibration/chain/ascent.py" not in found
    assert not any("stages" in path.parts for path in found)


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
