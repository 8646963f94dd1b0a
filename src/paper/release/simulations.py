"""The paper's simulations beside ours: the rows of docs/results.md, from the kept results."""

from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError
from calibration.files import read_json
from diagnosis.compared import sentence_of
from diagnosis.compared import told as size
from paper.release.parts import TRIED

HEAPS = ("Table 6", "Table 10", "Table 11")
"""Tables of heaps."""


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} for docs/results.md, from the folder of a kept study."""
    kept = Path(kept)
    found = found_of(kept)
    return {
        "rows": [_row(name, one) for name, one in found.items()],
    }


def found_of(kept: str | Path) -> dict[str, Any]:
    """{table: what `diagnosis.compared.compare` says} of a kept study; of the tables of heaps where
    causes were tried with several seeds at a row, in the studies beside it."""
    own, *more = (read_json(f / "disagreement" / "disagreement.json") for f in _folders(kept))
    return own | ({name: _together([one[name] for one in more]) for name in HEAPS} if more else {})


def _together(found):
    """One table as several studies of the same rows found it: every cause that was tried, with the
    greatest of its chances, as the best of more causes is as good by chance more often."""
    causes: dict[str, dict] = {}
    for one in found:
        for cause in one["ranking"]:
            known = causes.get(cause["cause"])
            if known is None or cause["p"] > known["p"]:
                causes[cause["cause"]] = cause
    ranking = sorted(causes.values(), key=lambda cause: -cause["gain"])
    whole = next(one for one in found if ranking[0] in one["ranking"]) | {"ranking": ranking}
    without = {k: v for one in found for k, v in one["without_value"].items()}
    return whole | {"without_value": without, "sentence": sentence_of(whole)}


def _folders(kept):
    """A kept study, and those beside it in which causes were tried with several seeds, where they
    were kept."""
    name, beside = Path(kept).name, Path(kept).parent
    folders = (Path(kept), *(beside / f"{name}-{causes}" for causes in TRIED))
    made = [f for f in folders if (f / "disagreement" / "disagreement.json").is_file()]
    if not made:
        raise CalibrationError(f"{kept}: holds no disagreement; `snakemake disagreement` makes it")
    return made


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
