"""What may start code: one list, told on a page, that holds every place in the sources; a file's
setting needs the user's consent."""

import ast
import csv
from pathlib import Path
from types import SimpleNamespace

import pytest

from calibration import engines
from calibration.errors import ConfigError
from calibration.intake import started_code
from calibration.intake.started_code import SETTINGS, allow, permit, refuse_unasked
from calibration.study.config.schema import Config
from facts import ROOT, refused

STARTERS = {
    "subprocess.run", "subprocess.Popen", "subprocess.call", "subprocess.check_call",
    "subprocess.check_output", "os.system", "os.popen", "os.execv", "os.execve", "os.execvp",
    "os.posix_spawn", "os.startfile", "eval", "exec", "__import__", "runpy.run_path",
    "runpy.run_module", "importlib.util.spec_from_file_location", "pickle.load", "pickle.loads",
    "joblib.load", "pd.read_pickle", "marshal.loads", "yaml.load", "yaml.unsafe_load",
    "yaml.full_load", "ctypes.CDLL", "pd.eval", "code.interact",
}  # fmt: skip
"""Calls that start a program or run Python that a text or a file holds."""
METHODS = {"exec_module", "load_module", "eval"}
OWN = {
    "dem/contact/dispatch.py": "a function that the laws' own declarations are written out to",
    "workflow/scripts/reference.py": "snakemake, for each study of the paper's reference",
    "paper/release/__main__.py": "the release's own commands",
}
"""Sources that start code of this project alone, and which; below src, or of the workflow."""
NUMBA = "dem/kernel_cache.py"
"""Lets numba load what it has kept, by a variable of the environment."""


def dotted(node):
    parts = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *parts[::-1]]) if isinstance(node, ast.Name) else f"?.{parts[0]}"


def starters(text):
    """Names of the calls of a source that start something, and `allow_pickle` where it is given."""
    tree = ast.parse(text)
    names = [dotted(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call) and _named(n.func)]
    found = {n for n in names if n in STARTERS or n.split(".")[-1] in METHODS}
    words = [k.arg for n in ast.walk(tree) if isinstance(n, ast.Call) for k in n.keywords]
    return found | ({"allow_pickle"} & set(words))


def _named(node):
    return isinstance(node, ast.Name | ast.Attribute)


def test_every_place_that_starts_code_is_on_the_list():
    src = ROOT / "src"
    files = [*src.rglob("*.py"), *(ROOT / "workflow/scripts").glob("*.py")]
    inside = [f for f in files if "workflow/profiles" not in str(f)]
    found = {f.relative_to(src if src in f.parents else ROOT).as_posix()
             for f in inside if starters(f.read_text("utf-8"))}  # fmt: skip
    with open(ROOT / "docs/starts_code.csv", encoding="utf-8") as table:
        listed = list(csv.DictReader(table))
    declared = {place for start in listed for place in start["places"].split()} | set(OWN)
    assert {start["name"] for start in listed} > set(SETTINGS)
    assert found == declared - {NUMBA}
    assert (src / NUMBA).is_file()


@pytest.fixture
def settings(tmp_path, monkeypatch):
    """A user's folder of settings of this test alone, and a folder to work in."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    monkeypatch.setattr(started_code, "_permitted", set())
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "settings" / "granular-calibration" / "allowed.json"


def configuration(**more):
    study = {
        "name": "s",
        "factors": "f",
        "measurements": "m",
        "tests": {"heap": {"experiment": "heap"}},
    }
    return Config.model_validate(study | more)


BOTH = {
    "engine": {"name": "command", "command": "solver {spec}", "version": "1"},
    "diagnosis": {"catalogue": "mine"},
}


@pytest.mark.parametrize("key", SETTINGS)
def test_a_setting_is_refused_until_it_is_asked_for(settings, key):
    section, name = key.split(".")
    config = configuration(**{section: BOTH[section]})
    value = BOTH[section][name]
    others = (None, {section: {name: "other"}}, {section: value})
    for asked in others:
        with refused(ConfigError, "calibration allow s.yaml", "--config", key=key, value=value):
            refuse_unasked(config, asked, ["s.yaml"])
    refuse_unasked(config, {section: {name: value}})


def test_a_consent_holds_for_its_folder_and_value_alone(settings, tmp_path, monkeypatch):
    config = configuration(**BOTH)
    assert allow(config, ".") == {"engine.command": "solver {spec}", "diagnosis.catalogue": "mine"}
    refuse_unasked(config, None)
    other = configuration(**BOTH | {"engine": BOTH["engine"] | {"command": "other {spec}"}})
    with refused(ConfigError, key="engine.command", value="other {spec}"):
        refuse_unasked(other, None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError):
        refuse_unasked(config, None)


def test_a_study_that_starts_nothing_needs_no_consent(settings):
    refuse_unasked(configuration(), None)
    refuse_unasked(configuration(engine="liggghts"), None)
    assert allow(configuration(), ".") == {}
    assert not settings.exists()


TOUCH = "touch {out}/../started"


def smuggled():
    """A run's spec that names a command by itself, as a plan or a result from elsewhere does."""
    chosen = {"name": "command", "command": TOUCH, "version": "1"}
    material = {"density_kg_m3": 1200, "shear_modulus_Pa": 1e7, "poisson_ratio": 0.25}
    contact = {"restitution": 0.5, "static_friction": 0.5, "rolling_friction": 0.1}
    return {
        "experiment": "drop",
        "seed": 1,
        "materials": {"particle": material, "wall": material},
        "contacts": {"particle_particle": contact, "particle_wall": contact},
        "particles": {"count": 1, "diameter_mm": 2.0},
        "engine": engines.entry_of(chosen),
    }


def test_a_run_s_spec_starts_no_command_that_its_study_does_not_name(settings, tmp_path):
    spec = smuggled()
    with refused(engines.EngineError, "engine.command", TOUCH):
        engines.make(spec, tmp_path / "work" / "run")
    assert not Path("started").exists()
    permit(SimpleNamespace(engine={"name": "command", "command": TOUCH}, diagnosis={}))
    with refused(engines.EngineError, "metrics.json"):  # it leaves none, but it is started
        engines.make(spec, tmp_path / "work" / "run")
    assert Path("started").exists()
