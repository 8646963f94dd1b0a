"""What a plain installation brings along is not more than it may be."""

import re
import tomllib
from importlib.metadata import distribution
from pathlib import Path

from packaging.requirements import Requirement

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"
MOST = 600.0  # MiB of files, without the bytecode that pip writes unless told not to


def required(requirements):
    """Distributions that requirements bring, with theirs."""
    found, left = {}, [Requirement(r) for r in requirements]
    while left:
        requirement = left.pop()
        key = re.sub("[-_.]+", "-", requirement.name).lower(), *sorted(requirement.extras)
        if key in found:
            continue
        found[key] = distribution(requirement.name)
        extras = requirement.extras or {""}
        for text in found[key].requires or []:
            more = Requirement(text)
            if more.marker is None or any(more.marker.evaluate({"extra": e}) for e in extras):
                left.append(more)
    return {key[0]: dist for key, dist in found.items()}


def mebibytes(dist):
    """Size of a distribution's files [MiB, as du counts], its bytecode left out."""
    paths = [Path(dist.locate_file(f)) for f in dist.files or [] if f.suffix != ".pyc"]
    return sum(path.stat().st_size for path in paths if path.is_file()) / 2**20


def test_a_plain_installation_is_small():
    wanted = tomllib.loads(PYPROJECT.read_text())["project"]["dependencies"]
    sizes = {name: mebibytes(dist) for name, dist in required(wanted).items()}
    heaviest = sorted(sizes, key=sizes.get)[-5:]
    assert sizes["numba"] > 10.0  # the files are counted
    assert sum(sizes.values()) < MOST, {name: round(sizes[name]) for name in heaviest}
    assert not {"vtk", "statsmodels", "scikit-image"} & sizes.keys()
