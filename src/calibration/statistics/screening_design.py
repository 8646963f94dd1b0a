"""Which design a screening takes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.statistics.definitive import definitive_screening
from calibration.statistics.design import plackett_burman, read_two_level
from calibration.statistics.factor import CodedFactor
from calibration.statistics.two_level import foldover, resolution_iv

KINDS = ("resolution_iv", "definitive", "plackett_burman")


def screening_design(factors: Sequence[CodedFactor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for: the configuration's section `screening`.

    rules.design: path of a table of coded levels, in place of a generated one; rules.kind: one of
    KINDS; centre_runs are added to a generated design (a definitive one has at least one); foldover
    appends the runs with all signs changed. Raises CalibrationError or ConfigError as the designs
    do.
    """
    choices = [f for f in factors if not f.has_middle]
    if choices and rules.kind == "definitive" and not rules.design:
        names = ", ".join(f.name for f in choices)
        raise CalibrationError(
            f"a definitive design has three levels of each factor, and there is none in the middle "
            f"of {names}"
        )
    if rules.design:
        design = read_two_level(rules.design, factors, rules.replicates)
    elif rules.kind == "resolution_iv":
        design = resolution_iv(factors, rules.centre_runs, rules.replicates)
    elif rules.kind == "definitive":
        design = definitive_screening(factors, max(rules.centre_runs, 1), rules.replicates)
    elif rules.kind == "plackett_burman":
        design = plackett_burman(factors, rules.replicates, rules.runs)
    else:
        raise CalibrationError(
            f"unknown screening design {rules.kind!r}; known: {', '.join(KINDS)}"
        )
    # a choice has no middle: a run at the centre has its first word
    design = design.assign(**{f.code: np.where(design[f.code] > 0, 1.0, -1.0) for f in choices})
    return foldover(design, factors) if rules.foldover else design
