"""Every name at the top of each package with the first sentence of its docstring, for the site's
page of the packages."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
LAYERS = ("paper", "diagnosis", "calibration", "dem")


def packages() -> list[str]:
    """Return the layers from the top down, each followed by its packages, as paths below `src`."""
    src = ROOT / "src"
    return [
        str(folder.relative_to(src))
        for layer in LAYERS
        for folder in [src / layer, *(p for p in names(layer) if p.is_dir())]
    ]


def names(package: str) -> list[Path]:
    """Modules and packages at the top of a package, by name."""
    inside = sorted((ROOT / "src" / package).iterdir())
    modules = [p for p in inside if p.suffix == ".py" and p.stem != "__init__"]
    packages = [p for p in inside if p.is_dir() and p.name != "workflow" and any(p.glob("*.py"))]
    return sorted([*modules, *packages], key=lambda p: p.stem)


def sentence(path: Path) -> str:
    """First sentence of the docstring of a module or a package, "" where there is none."""
    file = path / "__init__.py" if path.is_dir() else path
    said = ast.get_docstring(ast.parse(file.read_text("utf-8"))) if file.is_file() else None
    first = " ".join((said or "").split("\n\n")[0].split())
    return re.split(r"(?<=[.;:]) (?=[A-Z])", first)[0].rstrip(".").replace("|", "\\|")


def tables() -> str:
    """Return a table for each package, as Markdown."""
    text = ""
    for package in packages():
        rows = [f"| `{p.name}{'/' * p.is_dir()}` | {sentence(p)} |" for p in names(package)]
        text += f"## `src/{package}`\n\n| name | what is in it |\n|---|---|\n"
        text += "\n".join(rows) + "\n\n"
    return text.strip()
