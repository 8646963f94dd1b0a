"""What is released and how: one version, one list of lint commands, lines that can be read."""

import re
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
MOST = 100  # characters of a line
NARROW = (".yaml", ".yml", ".smk", ".rst", ".cff", ".toml", ".py")


def tracked():
    """Files of the repository that exist; all below it where git is not at hand."""
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [p for name in listed.stdout.splitlines() if (p := ROOT / name).is_file()]


def lint_commands():
    """Commands of .ci/run under its comment on the lint, without the environment's folder."""
    block = (ROOT / ".ci/run").read_text().split("# the lint;")[1].split("\n\n")[0]
    return [line.removeprefix(".venv/bin/") for line in block.splitlines()[1:]]


def test_pre_commit_runs_the_lint_of_ci():
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())
    hooks = [hook for repo in config["repos"] for hook in repo["hooks"]]
    assert [hook["entry"] for hook in hooks] == lint_commands()
    assert len(hooks) == 7
    assert not any(hook["pass_filenames"] for hook in hooks)


def test_the_version_is_the_same_everywhere():
    stated = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.M)[1]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.findall(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text(), re.M)[0]
    assert citation["version"] == stated
    assert newest == stated
    assert f"granular_calibration-{stated}-py3" in (ROOT / "docs/install.md").read_text()


def test_a_release_is_of_the_version_that_its_tag_names():
    release = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())
    steps = "\n".join(s.get("run", "") for s in release["jobs"]["release"]["steps"])
    check = next(line for line in steps.splitlines() if line.startswith("grep"))
    version = yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"]
    for tag, status in ((f"v{version}", 0), ("v9.9.9", 1)):
        done = subprocess.run(
            ["bash", "-c", check], cwd=ROOT, env={"GITHUB_REF_NAME": tag}, check=False
        )
        assert done.returncode == status
    notes = next(line for line in steps.splitlines() if line.startswith("awk"))
    shown = subprocess.run(
        ["bash", "-c", notes.replace("> notes.md", "")],
        cwd=ROOT,
        env={"GITHUB_REF_NAME": f"v{version}"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    changes = (ROOT / "CHANGELOG.md").read_text()
    assert shown.strip() == changes.split(f"## {version}\n")[1].split("\n## ")[0].strip()
    assert "python -m build" in steps
    assert "dist/*" in steps


def test_no_line_is_longer_than_it_may_be():
    long = [
        f"{path.relative_to(ROOT)}:{n}"
        for path in tracked()
        if path.suffix in NARROW or path.name in ("Snakefile", "run")
        for n, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if len(line.partition("  # type: ignore")[0]) > MOST
    ]
    assert not long


def prose(text):
    """(number, line) of a page's lines outside of code, tables and what programs wrote into it."""
    code = written = False
    for n, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            code = not code
        elif line.startswith("<!--"):
            written = " end" not in line
        elif not (code or written or line.lstrip().startswith(("|", "!["))):
            yield n, line


PAGES = ("*.md", "config/*.md", "data/*/*.md", "docs/**/*.md", "examples/*/*.md")


@pytest.mark.parametrize(
    "page", [p for pattern in PAGES for p in ROOT.glob(pattern)],
    ids=lambda p: p.relative_to(ROOT).as_posix(),
)  # fmt: skip
def test_prose_is_wrapped_where_it_can_be(page):
    long = [
        n
        for n, line in prose(page.read_text("utf-8"))
        # a code span or a link's address is not broken
        if len(line) > MOST and " " in re.sub(r"`[^`]*`|\]\(\S*", "-", line[:MOST]).lstrip("-* ")
    ]
    assert not long
