"""Which design a screening takes."""

from calibration.errors import CalibrationError
from calibration.statistics.definitive import definitive_screening
from calibration.statistics.design import plackett_burman, read_two_level
from calibration.statistics.two_level import foldover, resolution_iv

KINDS = ("resolution_iv", "definitive", "plackett_burman")


def screening_design(factors, rules):
    """The design table that `rules` ask for: the configuration's section `screening`.

    rules.design: path of a table of coded levels, in place of a generated one; rules.kind: one of
    KINDS; centre_runs are added to a generated design (a definitive one has at least one); foldover
    appends the runs with all signs changed. Raises CalibrationError or ConfigError as the designs
    do.
    """
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
    return foldover(design, factors) if rules.foldover else design
