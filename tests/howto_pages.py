"""Pages that say how to add something, done word by word: their blocks are applied to a copy.

A block begins with a line that says where it goes: `# FILE` is a new file; `# FILE, before: TEXT`
goes above the one line that begins with the text, as far from the margin as that; `# FILE, in place
of: TEXT` replaces the text.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import indent

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(
    r"^```\w+\n# ([\w./]+)(?:, (before|in place of): ([^\n]+))?\n(.*?)^```$", re.M | re.S
)


def copy_with(page, folder):
    """Copy src, workflow and what studies need into a folder and apply the page; the paths of the
    files that are new or changed."""
    shutil.copytree(ROOT / "src", folder / "src", symlinks=True,
                    ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    shutil.copytree(ROOT / "workflow", folder / "workflow", symlinks=True)
    for name in ("Snakefile", "config", "profiles", "data"):
        (folder / name).symlink_to(ROOT / name)
    blocks = BLOCK.findall((ROOT / "docs" / page).read_text("utf-8"))
    assert blocks, f"{page} has no block"
    for path, how, text, block in blocks:
        _apply(folder / path, how, text, block.strip("\n") + "\n")
    return {path for path, *_ in blocks}


def _apply(path, how, text, block):
    if not how:
        assert not path.exists(), f"{path} is there already"
        path.write_text(block)
        return
    old = path.read_text()
    if how == "in place of":
        assert old.count(text) == 1, f"{path}: {text}"
        path.write_text(old.replace(text, block.strip()))
        return
    [line] = re.findall(rf"^ *{re.escape(text)}.*\n", old, re.M)
    margin = line[: len(line) - len(line.lstrip())]
    gap = "\n\n" if block.startswith("def ") else ""
    path.write_text(old.replace(line, f"{indent(block, margin)}{gap}{line}"))


def python(folder, *words):
    """Run Python with the copy's packages in its folder; the finished process."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
