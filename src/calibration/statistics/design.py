"""Designs of experiments as tidy tables: a row a run, coded and natural levels side by side. For a
screening: two levels of resolution IV, Plackett and Burman's, or a table; their foldovers, and what
is aliased with what. For a region: Box-Behnken's, composite ones, and points that fill a space.

Columns: `run` (1...), `replicate`, one column a factor code with the coded level, one a factor name
with the natural level.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import scipy

from calibration.errors import CalibrationError, ConfigError, RankDeficientError
from calibration.intake.tables import refused
from calibration.statistics.factor import Factor
from calibration.statistics.surface import check_rank
from dem.tables import read_table

TRIPLES = {
    6: ("124", "235", "346", "145", "256", "136"),
    7: ("456", "167", "257", "124", "347", "135", "236"),
}
"""Factors that leave the centre together (Box and Behnken 1960, Technometrics 2:455). pyDOE3 pairs
them instead and takes 60 and 84 runs; the published designs take 48 and 56."""


def box_behnken(
    factors: Sequence[Factor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Box-Behnken design for 3 to 7 factors. Raises CalibrationError for another number."""
    k = len(factors)
    if not 3 <= k <= 7:
        raise CalibrationError(f"a Box-Behnken design takes 3 to 7 factors, not {k}")
    if k not in TRIPLES:
        import pyDOE3

        matrix = np.asarray(pyDOE3.bbdesign(k, center=centre_runs), float)
        return tabulate(matrix, factors, replicates)
    corners = list(product((-1.0, 1.0), repeat=3))
    rows = np.zeros((len(TRIPLES[k]) * len(corners) + centre_runs, k))
    for n, (block, signs) in enumerate(product(TRIPLES[k], corners)):
        rows[n, [int(c) - 1 for c in block]] = signs
    return tabulate(rows, factors, replicates)


def region_design(factors: Sequence[Factor], rules: Any) -> pd.DataFrame:
    """The design table that `rules` ask for, the configuration's section `response_surface`:
    Box-Behnken for 3 to 7 factors, a face-centred composite design for fewer. Raises
    CalibrationError for more."""
    design = central_composite if len(factors) < 3 else box_behnken
    return design(factors, rules.centre_runs, rules.replicates)


def central_composite(
    factors: Sequence[Factor], centre_runs: int = 5, replicates: int = 1
) -> pd.DataFrame:
    """Central composite design: corners, star points on the faces of the region and centre, in that
    order (Box and Hunter 1957, Annals of Mathematical Statistics 28:195)."""
    k = len(factors)
    corners = np.array(list(product((-1.0, 1.0), repeat=k)))
    star = np.vstack([sign * np.eye(k)[i] for i in range(k) for sign in (-1.0, 1.0)])
    return tabulate(np.vstack([corners, star, np.zeros((centre_runs, k))]), factors, replicates)


def steepest_path(
    factors: Sequence[Factor],
    start: Mapping[str, float],
    step: Mapping[str, float],
    steps: int,
    replicates: int = 1,
) -> pd.DataFrame:
    """`steps` points start + k step in natural levels, the whole path repeated `replicates` times;
    start, step: {factor name: value}. Levels outside a factor's range raise CalibrationError."""
    rows: list[dict[str, Any]] = []
    for r, k in product(range(replicates), range(steps)):
        row: dict[str, Any] = {"run": len(rows) + 1, "replicate": r + 1}
        for f in factors:
            value = round(start[f.name] + k * step[f.name], 9)
            if not f.low - 1e-9 <= value <= f.high + 1e-9:
                raise CalibrationError(
                    f"step {k + 1} of the ascent takes {f.name} to {value:g}, outside {f.low:g} to "
                    f"{f.high:g}"
                )
            row[f.code], row[f.name] = f.coded(value), value
        rows.append(row)
    return pd.DataFrame(rows)


def path_from_effects(
    factors: Sequence[Factor], effects: Mapping[str, float], steps: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Start and step, {factor name: value} each, of a path from the low-response corner to the
    high-response one.

    Each factor moves in the direction of its effect, from the end of its range where the response
    is low, by steps in proportion to its effect. The factor with the largest effect crosses its
    whole range. steps: two or more. Raises CalibrationError when no factor has an effect.
    """
    largest = max(abs(effects[f.code]) for f in factors)
    if largest == 0.0:
        raise CalibrationError("no factor has an effect; there is no way up")
    start, step = {}, {}
    for f in factors:
        share = effects[f.code] / largest
        step[f.name] = 2.0 * f.half_range * share / (steps - 1)
        start[f.name] = f.centre - 0.5 * (steps - 1) * step[f.name]
    return start, step


def tabulate(matrix: np.ndarray, factors: Sequence[Factor], replicates: int = 1) -> pd.DataFrame:
    """Design table of a coded matrix (runs, factors), the whole design repeated `replicates`
    times."""
    rows: list[dict[str, Any]] = []
    for r in range(replicates):
        for levels in matrix:
            row: dict[str, Any] = {"run": len(rows) + 1, "replicate": r + 1}
            row |= {f.code: float(x) for f, x in zip(factors, levels, strict=True)}
            row |= {f.name: f.natural(float(x)) for f, x in zip(factors, levels, strict=True)}
            rows.append(row)
    return pd.DataFrame(rows)


def space_filling(count: int, d: int, seed: int) -> np.ndarray:
    """Points (count, d) in [0, 1]^d, the first of a scrambled Sobol sequence (Owen 1998, Journal of
    Complexity 14:466)."""
    doublings = max(int(np.ceil(np.log2(count))), 1)
    points: np.ndarray = scipy.stats.qmc.Sobol(d, seed=seed).random_base2(doublings)
    return points[:count]


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
    table.require(*codes)
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
        where = {"line": line, "column": code, "value": row[code]}
        raise refused("no level", table.path, run=k + 1, **where) from None
