"""A stage reads no section of the configuration that its rule does not declare. A job that does is
refused, but only when it runs, after its simulations. Here the code of each stage is looked through
instead, with all that it calls by name."""

import ast
import inspect
import textwrap
from functools import cache
from types import SimpleNamespace

import pytest

from calibration.chain.study import ALWAYS, Study
from calibration.study.config import Config
from calibration.study.stages import resolve
from workflow_rules import ROOT, rules_of

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
            if owner == "config" and node.attr in Config.model_fields:
                sections.add(node.attr)
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


def test_what_is_read_far_below_a_stage_is_seen(rules):
    """Else the test above could not fail: sections that are read by what the stage calls, by a
    property of the study, and by nothing."""
    found = read_by(plain(resolve(rules["export_converted"].function)))
    assert {"targets", "rigs", "factors", "run"} <= found.keys()
    assert "ascent" not in found


def test_a_name_of_its_own_is_not_followed():
    config = SimpleNamespace(targets=1, rigs=2)

    def stage(study):
        rules_of = study.config.run  # a function of this module has the same name
        return rules_of, config.targets

    assert looked_through(stage) == ({"run", "targets"}, [])
