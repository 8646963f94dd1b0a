"""What a verdict of emulated experiments says of errors of the set-up: the single reading that is
at odds with all others, named by its line, or errors of every setting."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES
from diagnosis.identify import MISFIT, Identification
from diagnosis.page.words import in_unit
from diagnosis.set_up_errors import EVERY
from diagnosis.settings import BASE


def with_errors(
    verdict: Mapping[str, Any], found: Identification, measurements: Sequence[Measurement]
) -> dict[str, Any]:
    """The mapping of verdict.json of an `Identification`: `error` where an error of the set-up
    explains what no mechanism does; with the error as a rival of the laws that it is not told
    from."""
    if found.verdict != "unexplained" and not found.error:
        return dict(verdict)
    if found.error == EVERY:
        return _with_every_setting(verdict, found, measurements)
    return _with_single(verdict, found, measurements)


def _with_rival(verdict, rival):
    """The mapping with a rival of each law."""
    laws = [law | {"rivals": [*law["rivals"], rival]} for law in verdict["laws"]]
    return verdict | {"laws": laws}


def _with_every_setting(verdict, found, measurements):
    """Of the experiment that misfits most."""
    base = found.fits[BASE]
    worst = int(np.argmax(base.scale[0]))
    kind = measurements[worst].experiment
    own = [i for i, m in enumerate(measurements) if m.experiment == kind]
    more = np.sqrt(np.maximum(base.scale[0, own] ** 2 - 1.0, 0.0)) * base.sd[0, own]
    sd = float(np.median(more))
    row = {"experiment": kind, "of": "settings", "what": "settings", "sd": sd}
    row |= {"p": found.lack_of_fit_p, "rivals": []}
    row["sentence"] = (
        f"From setting to setting the {QUANTITIES[kind].words} scatters by "
        f"{in_unit(kind, sd, '.2g')} more than the errors of the readings say."
    )
    if found.verdict == "unexplained":
        return verdict | {"verdict": "error", "errors": [*verdict["errors"], row]}
    words = "an error of its own of each setting"
    return _with_rival(verdict, {"experiment": kind, "of": "settings", "words": words})


def _with_single(verdict, found, measurements):
    """The row, where the base model fits all others."""
    base = found.fits[BASE]
    off = (base.residual / np.sqrt(1.0 - base.leverage))[0]
    worst = int(np.argmax(np.abs(off)))
    # chi-square falls by so much when a setting is left out
    left = float(base.misfit[0] - off[worst] ** 2)
    if chi2.sf(left, max(float(base.freedom[0]) - 1.0, 1.0)) < MISFIT:
        return dict(verdict)
    m = measurements[worst]
    where = f"Line {m.line}" if m.line is not None else "A row"
    quantity = QUANTITIES[m.experiment]
    row = {"experiment": m.experiment, "line": m.line, "standard_deviations": float(off[worst])}
    row["sentence"] = (
        f"{where}: the {quantity.words} of {m.value:.4g} {quantity.unit}".rstrip()
        + f" lies {abs(off[worst]):.1f} standard deviations from what all others say, and alone "
        "explains the misfit."
    )
    if found.verdict == "unexplained":
        return verdict | {"verdict": "error", "rows": [row]}
    words = f"{where[:1].lower()}{where[1:]}"
    rival = {"experiment": m.experiment, "line": m.line, "words": words}
    return _with_rival(verdict, rival) | {"rows": [row]}
