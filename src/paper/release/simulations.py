"""The paper's simulations beside ours: what `docs/diagnosis-paper-case.md` says of each table, from
the kept results; `simulations.md.j2` has the words."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError
from calibration.files import read_json
from diagnosis.compared import told as size

HEAPS = ("Table 6", "Table 10", "Table 11")
"""Tables that the results page tells of."""


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `simulations.md.j2`, from the folder of a kept study."""
    found = found_of(kept)
    return {
        "pages": [folder.name for folder in _folders(kept)],
        "rows": [_row(name, one) for name, one in found.items()],
        "spread": degrees(size(found["Table 11"]["spread"], "deg")),
        "sentences": sentences(found, tuple(found)),
        "without": [
            f"{cause}, at {part['runs']} of {part['runs'] + part['others']} rows of {name}"
            for name, one in found.items()
            for cause, part in one["without_value"].items()
        ],
        "lost": [
            f"{name}, line {', '.join(map(str, one['ours_without_value']))}"
            for name, one in found.items()
            if one["ours_without_value"]
        ],
    }


def found_of(kept: str | Path) -> dict[str, Any]:
    """{table: what `diagnosis.compared.compare` says} of a kept study; of the tables of heaps where
    the causes were crossed, in the study beside it."""
    own, *more = (read_json(f / "disagreement" / "disagreement.json") for f in _folders(kept))
    return own | {name: one[name] for one in more for name in HEAPS}


def _folders(kept):
    """A kept study, and the one whose causes were crossed where it was kept."""
    folders = (Path(kept), Path(kept).parent / f"{Path(kept).name}-crossed")
    made = [f for f in folders if (f / "disagreement" / "disagreement.json").is_file()]
    if not made:
        raise CalibrationError(f"{kept}: holds no disagreement; `snakemake disagreement` makes it")
    return made


def of_heaps(kept: str | Path) -> dict[str, str]:
    """The sentences of the tables of heaps."""
    return sentences(found_of(kept))


def sentences(found: Mapping[str, dict[str, Any]], tables: Sequence[str] = HEAPS) -> dict[str, str]:
    """{table: what differs and what explains it, in degrees} of a `disagreement.json`."""
    return {name: degrees(found[name]["sentence"]) for name in tables if name in found}


def degrees(text: str) -> str:
    """Angles as the pages write them."""
    return text.replace(" deg", "°")


def _row(name, one):
    """Cells of a table: what it differs by, the cause that predicts it best, what that leaves and
    its chance."""
    best, unit = one["ranking"][0], one["unit"]
    at = (
        " at " + f"{best['strength']:.3g} {best['unit']}".removesuffix(" 1") if best["unit"] else ""
    )
    cause = f"{best['cause'].replace('_', ' ')}{at} (p = {best['p']:.2g})"
    left = size(best["scatter_after"], unit)
    if best["p_left"] is not None:
        left += f" (p = {best['p_left']:.1g})"
    return [name, *map(degrees, (size(one["scatter_before"], unit), one["verdict"], cause, left))]
