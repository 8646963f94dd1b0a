"""Hook of mkdocs that adds the page of the packages' licences, made anew at every build from what
is installed."""

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
HEAD = """# Licences

This project is under the MIT licence. It is used with the packages below, which it does not ship:
those of `requirements.lock` and `requirements-dev.lock`, with the licence that each states in its
metadata.

| package | version | licence |
|---|---|---|
"""
LONGEST = 60  # characters; a longer field holds a text and no name
NAMED = ("MIT License", "Apache License", "BSD 3-Clause License", "BSD 2-Clause License")


def locked():
    """{package: version} of what the project needs on every platform, and its developers."""
    texts = [(ROOT / name).read_text() for name in ("requirements.lock", "requirements-dev.lock")]
    found = re.findall(r"^([\w.-]+)==([^\s;]+)(.*)", "\n".join(texts), re.M)
    return {name: version for name, version, marker in found if "sys_platform" not in marker}


def licence_of(package):
    """Licence that an installed package states: expression, classifiers, field or the first line of
    its licence file, whichever is there first; "" where none is. Raises PackageNotFoundError."""
    found = distribution(package)
    metadata = found.metadata
    classifiers = [
        text.split(" :: ")[-1]
        for text in metadata.get_all("Classifier") or ()
        if text.startswith("License :: ") and not text.endswith("OSI Approved")
    ]
    field = (metadata.get("License") or "").strip()
    if len(field) > LONGEST or field == "UNKNOWN":
        field = ""
    expression = metadata.get("License-Expression")
    return expression or " or ".join(classifiers) or field or _from_file(found)


def _from_file(found):
    for file in found.files or ():
        if re.search(r"licen[cs]e", file.name, re.IGNORECASE) and file.locate().is_file():
            text = file.locate().read_text(encoding="utf-8", errors="replace")
            return next((name for name in NAMED if text.lstrip().startswith(name)), "")
    return ""


def page():
    """The page as markdown; a package that is not installed here is named so."""
    rows = []
    for package, version in sorted(locked().items(), key=lambda item: item[0].lower()):
        try:
            shown = licence_of(package) or "not stated"
        except PackageNotFoundError:
            shown = "not installed where this page was made"
        rows.append(f"| {package} | {version} | {shown} |\n")
    return HEAD + "".join(rows)


def on_files(files, config):
    """Add the page to what lies in docs/ (called by mkdocs)."""
    files.append(File.generated(config, "reference/licences.md", content=page()))
    return files
