"""A stage reads no section of the configuration that its rule does not declare. A job that does is
refused, but only when it runs, after its simulations. Here the code of each stage is looked through
instead, with all that it calls by name.

And it touches no result that its rule does not declare, as far as stages are called here:
`Declared.call` holds each to it.
"""

import ast
import inspect
import textwrap
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest

from calibration.chain.jobs import leave_record
from calibration.chain.study import ALWAYS, OF, Study
from calibration.runs.records import altered
from calibration.study.config import Config
from calibration.study.config.schema import VIEWS
from calibration.study.stage import load_stages, resolve
from calibration.telling.report import build
from opened.watch import undeclared, watching
from workflow.test_targets import angle, run_chain, study
from workflow_rules import ROOT, flat, read_workflow, rules_of

OURS = ("calibration", "diagnosis", "paper")


@cache
def looked_through(function):
    """({sections that it reads}, [functions of ours that it names]) of one function."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    nodes = list(ast.walk(tree))
    known = dict(function.__globals__)
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            module = __import__(node.module, fromlist=["any"])
            known |= {a.asname or a.name: getattr(module, a.name) for a in node.names}
    own = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    own |= {n.arg for n in nodes if isinstance(n, ast.arg)}
    sections, named = set(), []
    for node in nodes:
        if isinstance(node, ast.Name) and node.id not in own:
            named.append(known.get(node.id))
        elif isinstance(node, ast.Attribute):
            owner = getattr(node.value, "id", getattr(node.value, "attr", None))
            section = OF.get(node.attr, node.attr)
            if owner == "config" and (section in Config.model_fields or section in VIEWS):
                sections.add(section)
            elif owner in ("study", "self"):
                named.append(inspect.getattr_static(Study, node.attr, None))
            else:
                named.append(getattr(known.get(owner), node.attr, None))
    return sections, [f for f in map(plain, named) if f]


def plain(thing):
    """A function of ours below its property, cache or decorator, or None."""
    for name in ("func", "fget", "__wrapped__"):
        thing = inspect.getattr_static(thing, name, None) or thing
    ours = inspect.isfunction(thing) and thing.__module__.split(".")[0] in OURS
    return thing if ours else None


def read_by(function):
    """{section: the function that reads it} of a function and of all that it calls."""
    seen, left, found = set(), [function], {}
    while left:
        function = left.pop()
        if function in seen:
            continue
        seen.add(function)
        sections, called = looked_through(function)
        found |= {section: f"{function.__module__}.{function.__name__}" for section in sections}
        left += called
    return found


@pytest.fixture(scope="module")
def rules():
    return rules_of(ROOT / "config/config.yaml", ROOT / "Snakefile", ROOT)


def test_every_stage_declares_what_it_reads(rules):
    missing = {}
    for name, rule in rules.items():
        found = read_by(plain(resolve(rule.function)))
        undeclared = found.keys() - {*rule.reads, *ALWAYS}
        missing |= {f"{name}: {section}": found[section] for section in undeclared}
    assert missing == {}


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
