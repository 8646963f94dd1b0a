"""The paper's simulations beside ours: what `docs/diagnosis-paper-case.md` says of each table, from
the kept results; `simulations.md.j2` has the words."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError
from calibration.files import read_json
from calibration.intake.tables import read_written
from diagnosis.compared import sentence_of
from diagnosis.compared import told as size
from paper.release import told
from paper.release.parts import TRIED
from paper.rigs import READINGS

HEAPS = ("Table 6", "Table 10", "Table 11")
"""Tables that the results page tells of."""
WORDS = {
    "one_flank_deg": "one flank alone",
    "protractor_deg": "a protractor",
    "radial_angle_deg": "the outline around the axis",
}
"""Readings of `paper.rigs` beside the study's own, which is the first of `READINGS`."""


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `simulations.md.j2`, from the folder of a kept study."""
    kept = Path(kept)
    found = found_of(kept)
    return {
        "pages": [
            (folder.name, TRIED.get(folder.name.removeprefix(f"{kept.name}-"), "Every cause"))
            for folder in _folders(kept)
        ],
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
        "rigs": [row for name in HEAPS for row in _rigs(name, found[name])],
        "readings": readings(kept.parent / "rigs"),
        "steps": time_steps(kept),
    }


def _rigs(table, found):
    """Rows of cells: each cause of the rig, the rows that it is compared at, what it leaves there
    and what the study's own rig does, and the chance of what it leaves."""
    compared = [
        (c["cause"], "all", c["scatter_after"], found["scatter_before"], c["p_left"])
        for c in found["ranking"]
        if c["kind"] == "rig"
    ]
    in_part = [
        (
            cause,
            f"{part['others']} of {part['runs'] + part['others']}",
            part["scatter_after"],
            part["scatter_before"],
            None,
        )
        for cause, part in found["without_value"].items()
    ]
    for cause, at, *scatters, chance in compared + in_part:
        left = [degrees(size(one, found["unit"])) for one in scatters]
        yield [table, cause, at, *left, "" if chance is None else f"{chance:.1g}"]


def readings(rigs: Path) -> dict[str, Any]:
    """What other readings of the same heaps give beside the study's own."""
    table = read_written(rigs / "runs.csv").dropna(subset=READINGS)
    own, *others = READINGS
    apart = table[others].sub(table[own], axis=0)
    error = apart.std() / math.sqrt(len(apart))
    return {
        "heaps": len(table),
        "means": [
            f"{WORDS[one]} {told.degrees(apart[one].mean(), 2)} ± {error[one]:.2f}°"
            for one in others
        ],
        "scatter": f"{apart.std().min():.1f} to {apart.std().max():.1f}°",
    }


def time_steps(kept: Path) -> dict[str, str]:
    """What shorter time steps change, over the points of the numerics."""
    table = read_written(kept / "numerics" / "numerics.csv")
    table = table[table["variant"].str.startswith("time step ")]
    shares = table["variant"].str.extract(r"(\d+) %", expand=False).unique()
    return {
        "shares": " and ".join(f"{share} %" for share in shares),
        "means": _range(table["difference"], table["difference"]),
        "intervals": _range(table["low"], table["high"]),
    }


def _range(low, high):
    return f"{told.degrees(low.min())} to {told.degrees(high.max())}"


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
