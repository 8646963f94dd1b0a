"""How much the grains of a heap may stick at most. A heap was measured, so that a set of parameters
at which none forms is not the material's, and half of a screening's runs stand at the end of a
range: the pilot moves this end in."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.files import write_text
from calibration.study.new.pilot import narrowed
from calibration.study.new.study import write_factors
from calibration.study.parcels import LAW, WITH_SIZE

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.factors import Factor

HALVINGS = 5  # of the upper end
HEAP = "angle_of_repose_deg"  # where a heap was measured
ROUGH = re.compile(r"contacts\..*friction$")


def sticking(config: Config, factors: Sequence[Factor]) -> list[Factor]:
    """The factors of a study of heaps that say how much its grains stick; none elsewhere."""
    return [f for f in factors if f.key in WITH_SIZE and config.target.metric == HEAP]


def eased(
    factors: Sequence[Factor], sticky: Sequence[Factor], fault: Callable[[dict[str, float]], str]
) -> tuple[list[Factor], str]:
    """Factors whose `sticky` ones end where a heap forms, and why it did not at their old end;
    `fault` of levels {key: level} is empty where one does. They end at the half, the quarter and so
    on of their upper end, as the first of these with a heap says where all frictions are at theirs:
    there heaps stand steepest. As they were where none has a heap, or the old end has one."""
    rough = {f.key: f.high if ROUGH.match(f.key) else f.centre for f in factors}
    share, why = 1.0, ""
    for _ in range(HALVINGS + 1):
        found = fault(rough | {f.key: share * f.high for f in sticky})
        if not found:
            return [_cut(f, share) if f in sticky else f for f in factors], why
        share, why = 0.5 * share, why or found
    return list(factors), ""


def _cut(factor, share):
    high = float(f"{share * factor.high:.3g}")
    if share == 1.0 or high <= factor.low:
        return factor
    return narrowed(factor, factor.low, high)


def write_eased(folder: str | Path, table: str | Path, factors: Sequence[Factor]) -> None:
    """Write the table, and the middle of the ranges of what sticks into the study's config.yaml and
    the ranges into its README.md."""
    write_factors(table, factors)
    path, page = Path(folder) / "config.yaml", Path(folder) / "README.md"
    text, told = path.read_text("utf-8"), page.read_text("utf-8")
    for f in factors:
        if f.key not in WITH_SIZE:
            continue
        for name in (f.name, f.key.removeprefix(f"{LAW}.")):
            text = re.sub(rf"(?m)^( +{name}: ).*$", rf"\g<1>{f.centre:.4g}", text)
        row = f"| {f.name} | {f.low:g} | {f.high:g} | {f.description} |"
        lines = [row if x.startswith(f"| {f.name} |") else x for x in told.split("\n")]
        told = "\n".join(lines)
    write_text(text, path)
    write_text(told, page)
