"""Tables 11 to 13, Eq. 28 and Section 3: the Box-Behnken design, its analysis of variance, the
regression, the optimum and its validation."""

from functools import lru_cache

import numpy as np
import pandas as pd
import pyDOE3
from scipy import stats
from scipy.optimize import linear_sum_assignment

from calibration.statistics import surface as fit
from paper.audit.paper import NAMES, Cells, Claims, Found, Paper, Printed, printed_number, propagate
from paper.audit.screening import ANOVA

DESIGN, RUNS = "table11_box_behnken", "table13_validation"
TABLE_12 = "table12_box_behnken_anova"
CODES = ["A", "B", "C"]
INTERACTIONS = ("AB", "AC", "BC")
EDGES = 12


def _key(name):
    """The paper's name of a term or source of `calibration.statistics.surface`."""
    return "1" if name == "Intercept" else name.replace("²", "2")


ALL_TERMS = {_key(fit.term_name(term)): term for term in fit.quadratic_terms(CODES)}
TERMS = tuple(term for term in ALL_TERMS if term != "1")


def _coefficients(surface):
    found = zip(surface.terms, surface.beta, strict=True)
    return {_key(fit.term_name(term)): float(b) for term, b in found}


def _printed_levels(paper):
    """Coded levels as printed, (n, 3)."""
    return paper.numbers(DESIGN, *(f"{axis}_printed" for axis in NAMES)).to_numpy()


def restored_levels(paper: Paper) -> np.ndarray:
    """The Box-Behnken design that changes the fewest printed levels, run by run, (n, 3).

    Where the print is a Box-Behnken design, it is returned unchanged.
    """
    printed = _printed_levels(paper)
    design = np.asarray(pyDOE3.bbdesign(3, center=len(printed) - EDGES), float)
    changes = (printed[:, None, :] != design[None, :, :]).sum(axis=2)
    rows, points = linear_sum_assignment(changes)
    restored = np.empty_like(printed)
    restored[rows] = design[points]
    return restored


@lru_cache(maxsize=2)
def regression(paper: Paper, terms: tuple[str, ...] = tuple(ALL_TERMS)) -> fit.Surface:
    """Regression of Table 11's angles on the restored levels, with all terms unless given."""
    table = pd.DataFrame(restored_levels(paper), columns=CODES)
    angles = paper.numbers(DESIGN, "angle_deg").angle_deg
    return fit.fit_surface(table, CODES, angles, [ALL_TERMS[t] for t in terms])


def _anova(paper):
    anova = regression(paper).anova
    return anova.set_index(anova["source"].map(_key))[ANOVA.split()].astype(float)


def _rank(paper, claim):
    terms = fit.model_matrix(_printed_levels(paper), CODES, list(ALL_TERMS.values()))
    printed = paper.text(TABLE_12).set_index("source")[ANOVA.split()].stack()
    cells = zip(_anova(paper).stack()[printed.index], printed, strict=True)
    right = [Found(value).compared(text)[0] for value, text in cells if text]
    rank = int(np.linalg.matrix_rank(terms))
    return Found(rank, terms=terms.shape[1], right=sum(right), cells=len(right))


def _misprints(paper, claim):
    wrong = np.any(_printed_levels(paper) != restored_levels(paper), axis=1)
    runs = paper.text(DESIGN, "run").run[wrong]
    return Found(wrong.sum(), runs=", ".join(runs))


def _rotatable(paper, claim):
    levels = restored_levels(paper)
    ratio = (levels[:, 0] ** 4).sum() / (levels[:, 0] ** 2 * levels[:, 1] ** 2).sum()
    return Found(ratio, exact=True)


def _heading(paper, row):
    """Which of two columns is df times the other, by the majority of the rows with more than one
    df."""
    rows = [
        (Printed.parse(r.sum_sq), float(r.df), Printed.parse(r.mean_sq))
        for r in paper.text(TABLE_12, "sum_sq", "df", "mean_sq").itertuples()
        if r.sum_sq and r.mean_sq and float(r.df) > 1
    ]
    forward = sum(_is_product(a, df, b) for a, df, b in rows)
    backward = sum(_is_product(b, df, a) for a, df, b in rows)
    first = row["column"] == "sum_sq"
    value = "sum of squares" if first == (forward > backward) else "mean square"
    place, most = "first" if first else "third", max(forward, backward)
    return Found(value, place=place, most=most, rows=len(rows))


def _is_product(total, df, mean):
    slack = (total.half_unit + df * mean.half_unit) * (1 + 1e-9)
    return abs(total.value - df * mean.value) <= slack


def _significant(paper, claim):
    terms = TERMS if claim.group == "model" else INTERACTIONS
    p = _anova(paper).p[list(terms)]
    low, high = (0.0, 0.01) if claim.part == "highly" else (0.01, 0.05)
    found = [t for t in terms if low <= p[t] < high]
    shown = ", ".join(f"{t} p = {p[t]:.4f}" for t in terms if t in INTERACTIONS)
    holds = set(claim.printed.split()) == set(found)
    return Found(" ".join(found) or "none", holds=holds, shown=shown)


def _trend(paper, claim):
    """Sign of the slope along one axis over the square of X and that axis, the other axis at its
    centre."""
    b = _coefficients(regression(paper))
    x, other = np.meshgrid(np.linspace(-1, 1, 101), np.linspace(-1, 1, 101))
    if claim.group == "fig9a":
        slope, name = b["B"] + b["AB"] * x + 2 * b["B2"] * other, "salt-salt restitution"
    else:
        slope, name = b["C"] + b["AC"] * x + 2 * b["C2"] * other, "salt-steel rolling friction"
    share = float((slope > 0).mean())
    # The statement is about the tendency: the mean slope decides.
    value = "rises" if slope.mean() > 0 else "falls"
    return Found(value, name=name, rises=share, falls=1 - share)


def printed_equation(paper: Paper) -> dict[str, Printed]:
    """Eq. 28's coefficients by term, the intercept as "1"."""
    tokens = [t.rpartition(":") for t in paper.scalar_text("eq28_coefficients").split()]
    return {term or "1": printed_number(text) for term, _, text in tokens}


def _coefficient(paper, row):
    """By the full model and by that of the printed terms alone; the one that comes nearer
    counts."""
    printed, term = printed_equation(paper), row["term"]
    kept = tuple(term for term in ALL_TERMS if term in printed)
    full = _coefficients(regression(paper))
    reduced = _coefficients(regression(paper, kept))
    misses = [sum((c[t] - cell.value) ** 2 for t, cell in printed.items()) for c in (full, reduced)]
    nearer = full if misses[0] <= misses[1] else reduced
    return Found(nearer[term], full=full[term], reduced=reduced[term])


def _equation_terms(paper, claim):
    p = _anova(paper).p[list(TERMS)]
    significant, kept = {t for t in TERMS if p[t] < 0.05}, set(printed_equation(paper)) - {"1"}
    lost, idle = sorted(significant - kept), sorted(kept - significant)
    value, printed = (" ".join(t for t in TERMS if t in some) for some in (significant, kept))
    told = {"lost": ", ".join(lost) or "none", "idle": ", ".join(idle) or "none"}
    return Found(value, printed=printed, holds=not lost and not idle, **told)


def _coding(paper):
    """Low level, centre and high level of the axes of Table 11, (3,) each."""
    coding = paper.keyed("table11_coding", "factor", "low", "centre", "high")
    return coding.loc[list(NAMES)].to_numpy().T


def _at_optimum(paper, predict):
    """(Value of an equation, a function of coded levels (n, 3), at the printed optimum, what the
    rounding of its settings adds); a setting that is a level of the design is exact."""
    low, centre, high = levels = _coding(paper)

    def at(natural):
        return float(predict((np.array([natural]) - centre) / ((high - low) / 2))[0])

    settings = [paper.scalar(f"optimum_{name}") for name in NAMES.values()]
    rounded = [
        Printed(s.text, s.value, 0.0) if s.value in own else s
        for s, own in zip(settings, levels.T, strict=True)
    ]
    return at([s.value for s in settings]), propagate(at, rounded)


def _optimum_of_equation(paper, claim):
    printed, target = printed_equation(paper), paper.value("measured_angle_of_repose")
    terms = [ALL_TERMS[t] for t in printed]

    def at_optimum(numbers):
        return _at_optimum(paper, lambda levels: fit.model_matrix(levels, CODES, terms) @ numbers)

    value, of_settings = at_optimum([cell.value for cell in printed.values()])
    rounding = propagate(lambda numbers: at_optimum(numbers)[0], list(printed.values()))
    return Found(value, rounding + of_settings, miss=abs(value - target))


def _optimum_of_regression(paper, claim):
    predict, grid = regression(paper).predict, np.linspace(-1, 1, 41)
    cube = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    target = paper.value("measured_angle_of_repose")
    band = paper.claims["validation.error"].value / 100 * target
    near = cube[np.abs(predict(cube) - target) <= band]
    low, centre, high = _coding(paper)
    natural = centre + (high - low) / 2 * near
    ends = zip(NAMES, natural.min(axis=0), natural.max(axis=0), strict=True)
    ranges = ", ".join(f"{axis} {a:.3g} to {b:.3g}" for axis, a, b in ends)
    value, rounding = _at_optimum(paper, predict)
    return Found(value, rounding, share=len(near) / len(cube), ranges=ranges)


# --- Table 13 -------------------------------------------------------------------------------------


def _runs(paper):
    return paper.numbers(RUNS, "group", "replicate", "angle_deg")


def _repeats(paper, claim):
    """Chance of at least the printed number of equal neighbours in a group, for independent normal
    angles."""
    runs = _runs(paper)
    neighbours = runs.groupby("group").angle_deg.diff().dropna()
    equal = int((neighbours.abs() < 1e-9).sum())
    printed = paper.printed(RUNS, "angle_deg")
    resolution = 2 * max(cell.half_unit for cell in printed if "." in cell.text)
    # Two readings of N(m, s) fall on the same step of the scale with the density of their
    # difference at 0.
    each = min(1.0, resolution / (2 * np.sqrt(np.pi) * runs.angle_deg.std()))
    chance = stats.binom.sf(equal - 1, len(neighbours), each)
    return Found(chance, equal=equal, neighbours=len(neighbours))


def _t_test(paper, claim):
    tables = _runs(paper), paper.angles()
    welch = stats.ttest_ind(*(t.angle_deg for t in tables), equal_var=False)
    means = (t.groupby("group").angle_deg.mean() for t in tables)
    low, high = welch.confidence_interval()
    groups = stats.ttest_ind(*means, equal_var=False).pvalue
    return Found(welch.pvalue, low=low, high=high, groups=groups)


CLAIMS: Claims = {
    "table11.rank": _rank,
    "table11.misprints": _misprints,
    "table11.rotatable": _rotatable,
    "model.cv": lambda paper, _: regression(paper).summary["CV_percent"],
    "model.r2": lambda paper, _: regression(paper).summary["R2"],
    "model.r2_adj": lambda paper, _: regression(paper).summary["R2_adj"],
    "model.r2_pred": lambda paper, _: regression(paper).summary["R2_pred"],
    "model.precision": lambda paper, _: regression(paper).summary["adequate_precision"],
    "model.p": lambda paper, _: _anova(paper).p["Model"],
    "model.lack_of_fit": lambda paper, _: _anova(paper).p["Lack of Fit"],
    "model.highly model.significant": _significant,
    "interaction.highly interaction.significant conclusion.highly": _significant,
    "fig9a.trend fig9b.trend": _trend,
    "fig9b.growth": lambda paper, _: _anova(paper).p["C2"],
    "eq28.terms": _equation_terms,
    "optimum.eq28": _optimum_of_equation,
    "optimum.regression": _optimum_of_regression,
    "validation.mean": lambda paper, _: _runs(paper).angle_deg.mean(),
    "validation.replicates": lambda paper, _: len(_runs(paper)),
    "validation.repeats": _repeats,
    "validation.error": lambda paper, _: paper.miss(
        "validated_angle_of_repose", "measured_angle_of_repose"
    ),
    "validation.t_test": _t_test,
}
CELLS: Cells = {
    "table12.{source}.{cell}": (
        TABLE_12, ANOVA, lambda paper, row: _anova(paper).loc[row["source"], row["cell"]]
    ),
    "table12.heading.{column}": ("table12_printed_headings", "printed_heading", _heading),
    "table12.summary.{statistic}": (
        "table12_summary", "value", lambda paper, row: regression(paper).summary[row["statistic"]]
    ),
    "eq28.{term}": (
        lambda paper: [
            {"term": term, "printed": cell.text} for term, cell in printed_equation(paper).items()
        ],
        "printed", _coefficient,
    ),
}  # fmt: skip
