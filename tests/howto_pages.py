"""docs/extend.md done word by word: an example's files, and the blocks of its section, are applied
to a copy of the project.

A block begins with a line that says where it goes: `# FILE, before: TEXT` goes above the one line
that begins with the text, as far from the margin as that; `# FILE, in place of: TEXT` replaces the
text. New files stand in `examples/extend/NAME` where they stand in the project.
"""

import os
import re
import shutil
from textwrap import indent

from facts import ROOT
from started import python

EXAMPLES = ROOT / "examples" / "extend"
BLOCK = re.compile(r"^```\w+\n# ([\w./]+), (before|in place of): ([^\n]+)\n(.*?)^```$", re.M | re.S)


def section(name):
    """Text of the page under the heading `name`."""
    text = (ROOT / "docs" / "extend.md").read_text("utf-8")
    return text.split(f"\n## {name.capitalize()}\n")[1].split("\n## ")[0]


def copy_with(folder, *names):
    """Copy src, workflow and what studies need into a folder and apply examples."""
    shutil.copytree(ROOT / "src", folder / "src", symlinks=True,
                    ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    shutil.copytree(ROOT / "workflow", folder / "workflow", symlinks=True)
    for linked in ("Snakefile", "config", "profiles", "data"):
        (folder / linked).symlink_to(ROOT / linked)
    for name in names:
        _add(folder, name)


def _add(folder, name):
    files, blocks = EXAMPLES / name, BLOCK.findall(section(name))
    assert files.is_dir() or blocks, f"{name} has neither files nor blocks"
    for path in (p for p in files.rglob("*") if p.is_file()):
        new = folder / path.relative_to(files)
        assert not new.exists(), f"{new} is there already"
        shutil.copyfile(path, new)
    for path, how, text, block in blocks:
        _apply(folder / path, how, text, block.strip("\n") + "\n")


def _apply(path, how, text, block):
    old = path.read_text()
    if how == "in place of":
        assert old.count(text) == 1, f"{path}: {text}"
        path.write_text(old.replace(text, block.strip()))
        return
    [line] = re.findall(rf"^ *{re.escape(text)}.*\n", old, re.M)
    margin = line[: len(line) - len(line.lstrip())]
    gap = "\n\n" if block.startswith("def ") else ""
    path.write_text(old.replace(line, f"{indent(block, margin)}{gap}{line}"))


def own_python(folder, *words):
    """Python with the copy's packages in its folder, as `started.python`."""
    return python(folder, *words, env=os.environ | {"PYTHONPATH": str(folder / "src")})
