"""Tests pin facts and not sentences: no assertion and no `match` holds four words in a row, so that
one can change a word of a message or a page without a test."""

import ast
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
MOST = 3
"""Words that a string may have which an assertion holds: a name, a value and its unit."""

FACTS = {"refused": 1, "tells": 1, "holds": 1}
"""Helpers whose arguments, from this place on, are what a text must hold."""


def words(text):
    """Number of words in a text: two letters or more in a row, or `a`."""
    return len([w for w in text.split() if re.search(r"[A-Za-z]{2}|^a$", w)])


def sentences(node):
    """Strings of more than MOST words in a syntax tree; what stands in the braces of an f-string
    counts as none."""
    if isinstance(node, ast.JoinedStr):
        texts = [v.value for v in node.values if isinstance(v, ast.Constant)]
        within = [v for v in node.values if not isinstance(v, ast.Constant)]
        found = [" ".join(texts)]
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        found, within = [node.value], []
    else:
        found, within = [], ast.iter_child_nodes(node)
    found = [text for text in found if words(text) > MOST]
    return [*found, *(text for part in within for text in sentences(part))]


def asserted(tree):
    """(line, expression) of everything that a test demands of a text: assertions, `match`, and the
    arguments of FACTS."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert):
            yield node.lineno, node.test
        elif isinstance(node, ast.Call):
            yield from ((node.lineno, k.value) for k in node.keywords if k.arg == "match")
            name = getattr(node.func, "id", None)
            yield from ((node.lineno, argument) for argument in node.args[FACTS.get(name, 99) :])


def bound(function):
    """{name: [syntax trees]} of the literals that a name of a test function stands for: by
    assignment, in a loop, or as one of its parameters."""
    found = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign):
            targets, literal = node.targets, node.value
        elif isinstance(node, ast.For | ast.comprehension):
            targets, literal = [node.target], node.iter
        else:
            continue
        if isinstance(literal, ast.Constant | ast.JoinedStr | ast.Tuple | ast.List):
            for name in (n for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)):
                found.setdefault(name.id, []).extend(_column(targets[0], name, literal))
    for call in (d for d in function.decorator_list if isinstance(d, ast.Call)):
        if "parametrize" in ast.unparse(call.func) and len(call.args) > 1:
            for name, trees in _parametrized(*call.args[:2]):
                found.setdefault(name, []).extend(trees)
    return found


def _column(target, name, literal):
    """What one name of `for a, b in ((1, 2), ...)` stands for; all of it for a single name."""
    rows = getattr(literal, "elts", [])
    if not isinstance(target, ast.Tuple) or name not in target.elts:
        return [literal]
    place = target.elts.index(name)
    return [row.elts[place] for row in rows if len(getattr(row, "elts", [])) > place]


def _parametrized(names, rows):
    """(name, [syntax trees]) of the parameters of a test."""
    names = ast.literal_eval(names)
    names = names.replace(",", " ").split() if isinstance(names, str) else list(names)
    for row in getattr(rows, "elts", []):
        cells = row.args if isinstance(row, ast.Call) else getattr(row, "elts", [])
        cells = cells if len(names) > 1 else [row]
        yield from ((name, [cell]) for name, cell in zip(names, cells, strict=False))


def compared(expression):
    """Names that an expression compares, or hands on as they are."""
    sides = [expression]
    for node in ast.walk(expression):
        if isinstance(node, ast.Compare):
            sides += [node.left, *node.comparators]
    sides = [side.value if isinstance(side, ast.Starred) else side for side in sides]
    return {side.id for side in sides if isinstance(side, ast.Name)}


def pinned(source):
    """{(line, sentence)} that the tests of a source pin."""
    tree = ast.parse(source)
    found = {(line, text) for line, at in asserted(tree) for text in sentences(at)}
    for function in (f for f in ast.walk(tree) if isinstance(f, ast.FunctionDef)):
        literals = bound(function)
        for line, expression in asserted(function):
            trees = (t for name in compared(expression) for t in literals.get(name, []))
            found |= {(line, text) for tree in trees for text in sentences(tree)}
    return found


def test_no_test_pins_a_sentence():
    found = {str(p.relative_to(TESTS)): pinned(p.read_text("utf-8")) for p in TESTS.rglob("*.py")}
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "source",
    [
        "assert 'the heap is too low' in said",
        "assert f'{n} heaps of {m} are too low' in said",
        "with raises(ValueError, match='the heap is low'): pass",
        "with refused(ValueError, 'heap', 'the heap is low'): pass",
        "def test():\n for part in ('the heap is low',):\n  assert part in said",
        "def test():\n text = 'the heap is low'\n assert said == text",
        "def test():\n for n, part in ((1, 'the heap is low'),):\n  assert part in said",
        "def test():\n assert all(p in said for p in ['the heap is low'])",
        "@mark.parametrize('part', ['the heap is low'])\ndef test(part):\n assert part in said",
        "@mark.parametrize(('n', 'part'), [(1, 'the heap is low')])\n"
        "def test(n, part):\n assert part in said",
    ],
)
def test_a_pinned_sentence_is_found(source):
    assert len(pinned(source)) == 1


@pytest.mark.parametrize(
    "source",
    [
        "assert '25.7 mm' in said, 'the heap is too low'",
        "assert 'A B C AB BC' == terms",
        "assert tells(said, 'drop height', '300 mm')",
        "def test():\n text = 'the heap is low'\n assert length(text) == 4",
        "@mark.parametrize(('said', 'n'), [('the heap is low', 4)])\n"
        "def test(said, n):\n assert n == length(said)",
    ],
)
def test_facts_and_what_a_test_is_given_are_not(source):
    assert pinned(source) == set()
