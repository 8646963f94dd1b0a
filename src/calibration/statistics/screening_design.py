"""Designs for a screening: two levels of resolution IV, Plackett and Burman's, or a table; their
foldovers, and what is aliased with what."""

import math
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from calibration.errors import CalibrationError, ConfigError, RankDeficientError
from calibration.intake.tables import read_table
from calibration.statistics.design import tabulate
from calibration.statistics.factor import Factor
from calibration.statistics.surface import check_rank

MAX_SCREENING = 23
GENERATORS = {7: "a b c d abc bcd acd", 8: "a b c d abc bcd acd abd"}
"""Published generators (Box, Hunter and Hunter 2005, table 6.22) of the 16-run designs. All others
are words of odd length, which give the same aliasing."""


def screening_design(factors: Sequence[Factor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for: the configuration's section `screening`.

    rules.design: path of a table of coded levels, in place of a generated one; centre_runs are
    added to one of resolution IV; foldover appends the runs with all signs changed. Raises
    CalibrationError or ConfigError as the designs do, and for a number of factors that no generated
    design takes.
    """
    if not (rules.design or 1 <= len(factors) <= MAX_SCREENING):
        raise CalibrationError(f"screening takes 1 to {MAX_SCREENING} factors, not {len(factors)}")
    if rules.design:
        design = read_two_level(rules.design, factors, rules.replicates)
    elif rules.kind == "resolution_iv":
        design = resolution_iv(factors, rules.centre_runs, rules.replicates)
    else:
        design = plackett_burman(factors, rules.replicates, rules.runs)
    # a choice has no middle: a run at the centre has its first word
    choices = [f for f in factors if not f.has_middle]
    design = design.assign(**{f.code: np.where(design[f.code] > 0, 1.0, -1.0) for f in choices})
    return foldover(design, factors) if rules.foldover else design


def resolution_iv(
    factors: Sequence[Factor], centre_runs: int = 0, replicates: int = 1
) -> pd.DataFrame:
    """The smallest two-level design of resolution IV for 1 to 23 factors, with runs at the centre.

    No main effect is aliased with another or with a two-factor interaction. Up to three factors it
    is the full factorial, in four runs or more.
    """
    import pyDOE3

    k = len(factors)
    matrix = pyDOE3.fracfact(generators(k))[:, :k]
    matrix = np.vstack([matrix, np.zeros((centre_runs, k))])
    return tabulate(matrix, factors, replicates)


def generators(k: int) -> str:
    """Generators of `resolution_iv`, a word a factor: single letters for the base, products of an
    odd number of them for the rest, which is what gives resolution IV."""
    if k in GENERATORS:
        return GENERATORS[k]
    base = max(2, k) if k <= 3 else next(b for b in range(3, 7) if 2 ** (b - 1) >= k)
    letters = "abcdef"[:base]
    odd = ("".join(w) for n in range(3, base + 1, 2) for w in combinations(letters, n))
    return " ".join([*letters, *list(odd)[: max(k - base, 0)]])


def foldover(design: pd.DataFrame, factors: Sequence[Factor]) -> pd.DataFrame:
    """The design (a table) followed by the same runs with all signs changed.

    It parts main effects from two-factor interactions (Box and Wilson 1951, Journal of the Royal
    Statistical Society B 13:1). Runs are numbered on; `fold` is 1 in the runs of the design, 2 in
    the new.
    """
    levels = design[[f.code for f in factors]].to_numpy(float)
    table = tabulate(np.vstack([levels, -levels]), factors)
    return table.assign(fold=np.repeat([1, 2], len(levels)))


def alias_groups(levels: npt.ArrayLike, codes: Sequence[str]) -> list[list[str]]:
    """Two-factor interactions of coded levels (n, factors) that these runs do not part.

    Returns a list of groups of pairs of codes. A pair that is aliased with a main effect, or with
    the mean, stands in the group of that code, or of 'mean'. Pairs of one group differ at most in
    sign and scale once the mean and the main effects are taken off both: a model of main effects
    and one of them fits as well as with another, as in Plackett and Burman's twelve runs.
    """
    x = np.asarray(levels, float)
    found = [("mean", np.ones(len(x)))] + [(c, x[:, i]) for i, c in enumerate(codes)]
    groups = [([name], column) for name, column in found]
    mains = np.column_stack([column for _, column in found])
    for i, j in combinations(range(len(codes)), 2):
        pair, column = (codes[i], codes[j]), x[:, i] * x[:, j]
        own = column - mains @ np.linalg.lstsq(mains, column, rcond=None)[0]
        size = np.linalg.norm(own)
        column = own / size if size > 1e-6 * math.sqrt(len(x)) else column
        for members, other in groups:
            if np.allclose(column, other) or np.allclose(column, -other):
                members.append(pair)
                break
        else:
            groups.append(([pair], column))
    return [members for members, _ in groups if len(members) > 1 or isinstance(members[0], tuple)]


def plackett_burman(
    factors: Sequence[Factor], replicates: int = 1, runs: int | None = None
) -> pd.DataFrame:
    """Plackett-Burman screening design for 1 to 23 factors.

    runs: a multiple of four above the number of factors; unless given, twelve, or the smallest that
    takes the factors. Columns that no factor uses leave degrees of freedom for the residual. Raises
    CalibrationError for another number.
    """
    k = len(factors)
    runs = runs or max(12, 4 * (k // 4 + 1))
    if runs % 4 or not k < runs <= MAX_SCREENING + 1:
        raise CalibrationError(f"{runs} runs do not make a Plackett-Burman design for {k} factors")
    import pyDOE3  # it loads a library in half a second

    matrix = np.asarray(pyDOE3.pbdesign(runs - 1), float)[:, :k]
    return tabulate(matrix, factors, replicates)


def read_two_level(
    path: str | Path, factors: Sequence[Factor], replicates: int = 1
) -> pd.DataFrame:
    """Two-level design from a CSV with one column of -1 and +1 a factor code, balanced or not.

    Raises ConfigError naming file, column and run, and where the runs cannot tell factors apart.
    """
    table = read_table(path)
    codes = [f.code for f in factors]
    missing = [c for c in codes if c not in table.header]
    if missing:
        raise ConfigError(
            f"lacks the columns {', '.join(missing)}", path=path, allowed=", ".join(codes)
        )
    matrix = np.array([[_level(table, k, code) for code in codes] for k in range(len(table.rows))])
    if len(matrix) == 0:
        raise ConfigError("has no runs", path=path)
    try:
        check_rank(np.column_stack([np.ones(len(matrix)), matrix]), ["the mean", *codes])
    except RankDeficientError as error:
        raise ConfigError(str(error), path=path) from None
    return tabulate(matrix, factors, replicates)


def _level(table, k, code):
    """Coded level of run k, from 0. Raises ConfigError naming line, column and run."""
    line, row = table.rows[k]
    try:
        return {-1.0: -1.0, 1.0: 1.0}[float(row[code])]
    except (ValueError, KeyError):
        reason = f"run {k + 1} has no level of a two-level design"
        raise table.fault(line, code, reason, row[code], "-1 and 1") from None
