"""A single reading that is at odds with the base model, of emulated experiments: where it alone
explains the misfit, it is named by its line."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES
from diagnosis.identify import MISFIT, Identification
from diagnosis.settings import BASE


def with_single(
    verdict: dict[str, Any], found: Identification, measurements: Sequence[Measurement]
) -> dict[str, Any]:
    """The mapping of verdict.json of an `Identification`: `error` with the row, where the base
    model fits all others; with the row beside the law that it is not told from; as it is where the
    base model does not fit the others, or where nothing is wrong."""
    if found.verdict != "unexplained" and not found.alone:
        return verdict
    base = found.fits[BASE]
    off = (base.residual / np.sqrt(1.0 - base.leverage))[0]
    worst = int(np.argmax(np.abs(off)))
    # chi-square falls by so much when a setting is left out
    left = float(base.misfit[0] - off[worst] ** 2)
    if chi2.sf(left, max(float(base.freedom[0]) - 1.0, 1.0)) < MISFIT:
        return verdict
    m = measurements[worst]
    where = f"Line {m.line}" if m.line is not None else "A row"
    quantity = QUANTITIES[m.experiment]
    row = {"experiment": m.experiment, "line": m.line, "standard_deviations": float(off[worst])}
    row["sentence"] = (
        f"{where}: the {quantity.words} of {m.value:.4g} {quantity.unit}".rstrip()
        + f" lies {abs(off[worst]):.1f} standard deviations from what all others say, and alone "
        "explains the misfit."
    )
    if not found.alone:
        return verdict | {"verdict": "error", "rows": [row]}
    rival = {"experiment": m.experiment, "line": m.line, "words": f"{where[:1].lower()}{where[1:]}"}
    for law in verdict["laws"]:
        law["rivals"] = [*law["rivals"], rival]
    return verdict | {"rows": [row]}
