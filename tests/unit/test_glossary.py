"""The words that the glossary rules out are not used in the documentation, the configuration or the
code."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
SEARCHED = (
    "README.md",
    "docs/*.md",
    "config/*",
    "examples/*/*.md",
    "src/**/*.py",
    "workflow/**/*.*",
)


def banned():
    """(word that is used, word that is not) of the table."""
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \| ([^|]+) \|$", GLOSSARY.read_text(), re.M)
    return [(word, other.strip()) for word, others in rows[1:] for other in others.split(",")]


def texts():
    for pattern in SEARCHED:
        for path in ROOT.glob(pattern):
            if path.is_file() and path != GLOSSARY and path.suffix not in (".csv", ".pyc"):
                yield path, path.read_text()


@pytest.mark.parametrize(("word", "other"), banned())
def test_one_word_stands_for_one_thing(word, other):
    # underscores part words in code
    use = re.compile(rf"(?<![a-z]){other}(s|es|ing)?(?![a-z])", re.I)
    found = [
        f"{path.relative_to(ROOT)}:{text[: m.start()].count(chr(10)) + 1}"
        for path, text in texts()
        for m in use.finditer(text)
    ]
    assert not found, f"{other}: the glossary's word is {word}"


def test_the_glossary_is_in_the_order_of_the_alphabet():
    words = re.findall(r"^\| ([^|]+) \|", GLOSSARY.read_text(), re.M)[2:]
    assert words == sorted(words)
    assert len(words) > 20
