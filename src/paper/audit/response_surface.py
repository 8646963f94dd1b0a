"""Tables 11 and 12 and Eq. 28: the Box-Behnken design, its analysis of variance, the regression and
the optimum."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import pyDOE3
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from calibration.statistics.surface import Surface
from paper.audit.fits import TERMS as ALL_TERMS
from paper.audit.fits import (
    by_source,
    coefficients,
    evaluate,
    fit_quadratic,
    quadratic_matrix,
)
from paper.audit.paper import AuditInputError, Claim, Paper
from paper.audit.printed import Printed, propagate
from paper.audit.verdict import AGREES, Recomputed, claim_check, judge, number, table_check

DESIGN = "table11_box_behnken"
AXES = ("X", "Y", "Z")
TERMS = tuple(term for term in ALL_TERMS if term != "1")
INTERACTIONS = ("AB", "AC", "BC")
EDGES = 12


def printed_levels(paper: Paper) -> np.ndarray:
    """Coded levels as printed, (n, 3)."""
    return paper.numbers(DESIGN, *(f"{axis}_printed" for axis in AXES)).to_numpy()


def box_behnken(runs: int) -> np.ndarray:
    """The three-factor Box-Behnken design of `runs` runs: 12 midpoints of edges, the rest at the
    centre, (runs, 3)."""
    return np.asarray(pyDOE3.bbdesign(3, center=runs - EDGES), float)


def restored_levels(paper: Paper) -> np.ndarray:
    """The Box-Behnken design that changes the fewest printed levels, run by run, (n, 3).

    Where the print is a Box-Behnken design, it is returned unchanged. Raises AuditInputError for a
    print with too few runs.
    """
    printed = printed_levels(paper)
    if len(printed) < EDGES + 1:
        raise AuditInputError(
            "too few runs for a Box-Behnken design", path=paper.folder / f"{DESIGN}.csv",
            value=len(printed), allowed=f"{EDGES + 1} or more",
        )  # fmt: skip
    design = box_behnken(len(printed))
    changes = (printed[:, None, :] != design[None, :, :]).sum(axis=2)
    rows, points = linear_sum_assignment(changes)
    restored = np.empty_like(printed)
    restored[rows] = design[points]
    return restored


def _angles(paper: Paper) -> np.ndarray:
    return paper.numbers(DESIGN, "angle_deg").angle_deg.to_numpy()


def model(paper: Paper) -> Surface:
    """Full quadratic regression of Table 11's angles on the restored levels."""
    return fit_quadratic(restored_levels(paper), _angles(paper))


@claim_check("table11.rank")
def design_rank(paper: Paper, claim: Claim) -> Recomputed:
    terms = quadratic_matrix(printed_levels(paper))
    rank = int(np.linalg.matrix_rank(terms))
    verdicts = [judge(*cell)["verdict"] for cell in anova_cells(paper)]
    return Recomputed(
        rank,
        disagrees=f"As printed the model is rank-deficient ({rank} of {terms.shape[1]}): no "
        f"regression of the printed "
        f"table exists. With Box-Behnken levels, taken here, {verdicts.count(AGREES)} of "
        f"{len(verdicts)} figures "
        "of Table 12 come out to their digits.",
    )


@claim_check("table11.misprints")
def misprints(paper: Paper, claim: Claim) -> Recomputed:
    wrong = np.any(printed_levels(paper) != restored_levels(paper), axis=1)
    runs = paper.text(DESIGN, "run").run[wrong]
    return Recomputed(
        int(wrong.sum()),
        disagrees=f"Runs {', '.join(runs)} are misprinted; anyone who repeats the printed design "
        f"runs other points.",
    )


@claim_check("table11.rotatable")
def rotatable(paper: Paper, claim: Claim) -> Recomputed:
    levels = restored_levels(paper)
    ratio = (levels[:, 0] ** 4).sum() / (levels[:, 0] ** 2 * levels[:, 1] ** 2).sum()
    return Recomputed(
        float(ratio),
        exact=True,
        disagrees="The design is Box-Behnken and not rotatable: the prediction's variance depends "
        "on the direction "
        "from the centre. The abstract's name for it is wrong, the analysis is not affected.",
    )


@table_check
def anova_cells(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    anova = by_source(model(paper).anova)
    table = paper.text("table12_box_behnken_anova", "source", "sum_sq", "df", "mean_sq", "F", "p")
    for row in table.itertuples(index=False):
        if row.source not in anova.index:
            raise AuditInputError(
                "no such source in the model", path=paper.folder / "table12_box_behnken_anova.csv",
                column="source", value=row.source, allowed=", ".join(anova.index),
            )  # fmt: skip
        for column in ("sum_sq", "df", "mean_sq", "F", "p"):
            if text := getattr(row, column):
                claim = Claim(
                    f"table12.{row.source}.{column}",
                    "Table 12",
                    f"{column} of {row.source}",
                    text,
                    "",
                )
                yield claim, Recomputed(float(anova.loc[row.source, column]))


@table_check
def headings(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    """Which of two columns is df times the other, by the majority of the rows with more than one
    df."""
    name = "table12_box_behnken_anova"
    rows = [
        (Printed.parse(r.sum_sq), float(r.df), Printed.parse(r.mean_sq))
        for r in paper.text(name, "sum_sq", "df", "mean_sq").itertuples(index=False)
        if r.sum_sq and r.mean_sq and float(r.df) > 1
    ]
    forward = sum(_is_product(a, df, b) for a, df, b in rows)  # type: ignore[arg-type]
    backward = sum(_is_product(b, df, a) for a, df, b in rows)  # type: ignore[arg-type]
    right = (
        ("sum of squares", "mean square")
        if forward > backward
        else ("mean square", "sum of squares")
    )
    printed = paper.text("table12_printed_headings", "column", "printed_heading")
    shown = dict(zip(printed.column, printed.printed_heading, strict=True))
    for column, heading in zip(("sum_sq", "mean_sq"), right, strict=True):
        place = {"sum_sq": "first", "mean_sq": "third"}[column]
        claim = Claim(
            f"table12.heading.{column}",
            "Table 12",
            f"Heading of the {place} column",
            shown[column],
            "",
        )
        yield (
            claim,
            Recomputed(
                heading,
                disagrees=f"The headings are swapped: df times mean square is the sum of squares, "
                f"in "
                f"{max(forward, backward)} of {len(rows)} rows, only when this column is read as "
                f"{heading}.",
            ),
        )


def _is_product(total: Printed, df: float, mean: Printed) -> bool:
    return abs(total.value - df * mean.value) <= (total.half_unit + df * mean.half_unit) * (
        1 + 1e-9
    )


@table_check
def summary_cells(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    found = model(paper).summary
    table = paper.text("table12_summary", "statistic", "value")
    for statistic, text in zip(table.statistic, table.value, strict=True):
        claim = Claim(
            f"table12.summary.{statistic}", "Table 12", f"{statistic} of the model", text, ""
        )
        yield claim, Recomputed(float(found[statistic]))


@claim_check(
    "model.cv",
    "model.r2",
    "model.r2_adj",
    "model.r2_pred",
    "model.precision",
    "model.p",
    "model.lack_of_fit",
)
def text_statistics(paper: Paper, claim: Claim) -> Recomputed:
    fit = model(paper)
    names = {
        "cv": "CV_percent",
        "r2": "R2",
        "r2_adj": "R2_adj",
        "r2_pred": "R2_pred",
        "precision": "adequate_precision",
    }
    sources = {"p": "Model", "lack_of_fit": "Lack of Fit"}
    key = claim.id.split(".")[1]
    value = fit.summary[names[key]] if key in names else by_source(fit.anova).loc[sources[key], "p"]
    return Recomputed(
        float(value), disagrees=f"A slip in the text: {value:.4g}. No consequence for the model."
    )


@claim_check(
    "model.highly",
    "model.significant",
    "interaction.highly",
    "interaction.significant",
    "conclusion.highly",
)
def significant_terms(paper: Paper, claim: Claim) -> Recomputed:
    terms = TERMS if claim.id.startswith("model") else INTERACTIONS
    p = by_source(model(paper).anova).p[list(terms)]
    found = [
        t for t in terms if (p[t] < 0.01 if claim.id.endswith("highly") else 0.01 <= p[t] < 0.05)
    ]
    said = claim.printed.split()
    shown = ", ".join(f"{t} p = {p[t]:.4f}" for t in terms if t in INTERACTIONS)
    return Recomputed(
        " ".join(found) or "none",
        holds=set(said) == set(found),
        disagrees=f"{shown}: the text contradicts Table 12. Do not rank the interactions by the "
        f"text.",
    )


@claim_check("fig9a.trend", "fig9b.trend")
def trend(paper: Paper, claim: Claim) -> Recomputed:
    """Sign of the slope along one axis over the square of X and that axis, the other axis at its
    centre."""
    b = coefficients(model(paper))
    x, other = np.meshgrid(np.linspace(-1, 1, 101), np.linspace(-1, 1, 101))
    if claim.id.startswith("fig9a"):
        slope, name = b["B"] + b["AB"] * x + 2 * b["B2"] * other, "salt-salt restitution"
    else:
        slope, name = b["C"] + b["AC"] * x + 2 * b["C2"] * other, "salt-steel rolling friction"
    share = float((slope > 0).mean())
    # The statement is about the tendency: the mean slope decides.
    value = "rises" if slope.mean() > 0 else "falls"
    return Recomputed(
        value,
        agrees=f"The regression rises over {share:.0%} of the square.",
        disagrees=f"The regression falls with the {name} over {1 - share:.0%} of the square: "
        "a change as the text says moves the angle the wrong way.",
    )


@claim_check("fig9b.growth")
def growth(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(
        float(by_source(model(paper).anova).loc["C2", "p"]),
        disagrees="The curvature in Z is not significant: no growth of the effect is shown.",
    )


def printed_equation(paper: Paper) -> dict[str, Printed]:
    """Eq. 28's coefficients by term, the intercept as "1". Raises AuditInputError for a coefficient
    that is no number or of no term."""
    found = {}
    for token in paper.scalar_text("eq28_coefficients").split():
        term, _, text = token.rpartition(":")
        coefficient = Printed.parse(text)
        if coefficient is None or (term or "1") not in ("1", *TERMS):
            raise AuditInputError(
                "is no term:number", path=paper.folder / "scalars.csv", key="eq28_coefficients",
                value=token,
            )  # fmt: skip
        found[term or "1"] = coefficient
    return found


@table_check
def equation_coefficients(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    """Against the full model and the model of the printed terms alone; the one that comes nearer
    counts."""
    printed = printed_equation(paper)
    kept = tuple(term for term in ALL_TERMS if term in printed)
    full, reduced = (
        coefficients(model(paper)),
        coefficients(fit_quadratic(restored_levels(paper), _angles(paper), kept)),
    )
    misses = [
        sum((c[term] - cell.value) ** 2 for term, cell in printed.items()) for c in (full, reduced)
    ]
    nearer = full if misses[0] <= misses[1] else reduced
    for term, cell in printed.items():
        claim = Claim(
            f"eq28.{term}",
            "Eq. 28",
            f"Coefficient of {term} in the regression of Table 11",
            cell.text,
            "deg",
        )
        yield (
            claim,
            Recomputed(
                float(nearer[term]),
                disagrees=f"Not the regression of Table 11, whether all ten terms are fitted "
                f"({full[term]:.3f}) or "
                f"only those printed ({reduced[term]:.3f}). Use the regression, not Eq. 28.",
            ),
        )


@claim_check("eq28.terms")
def equation_terms(paper: Paper, claim: Claim) -> Recomputed:
    p = by_source(model(paper).anova).p[list(TERMS)]
    significant, kept = {t for t in TERMS if p[t] < 0.05}, set(printed_equation(paper)) - {"1"}
    lost, idle = sorted(significant - kept), sorted(kept - significant)
    return Recomputed(
        " ".join(t for t in TERMS if t in significant),
        printed=" ".join(t for t in TERMS if t in kept),
        holds=not lost and not idle,
        disagrees=f"Significant but dropped: {', '.join(lost) or 'none'}; kept without being "
        f"significant: "
        f"{', '.join(idle) or 'none'}.",
    )


def _optimum(paper: Paper) -> list[Printed]:
    names = ("salt_salt_rolling_friction", "salt_salt_restitution", "salt_steel_rolling_friction")
    return [paper.scalar(f"optimum_{name}") for name in names]


def _coding(paper: Paper) -> pd.DataFrame:
    table = paper.numbers("table11_coding", "low", "centre", "high")
    return table.set_axis(paper.text("table11_coding", "factor").factor).loc[list(AXES)]


def _predict(paper: Paper, equation: dict[str, float], natural: ArrayLike) -> float:
    coding = _coding(paper)
    coded = (np.asarray(natural) - coding.centre) / ((coding.high - coding.low) / 2)
    return float(evaluate(equation, coded.to_numpy()[None, :])[0])


def _setting_rounding(paper: Paper, equation: dict[str, float]) -> float:
    """What the optimum's rounding adds; a setting that is a level of the design is exact."""
    levels = _coding(paper).to_numpy()
    settings = [
        Printed(s.text, s.value, 0.0) if s.value in row else s
        for s, row in zip(_optimum(paper), levels, strict=True)
    ]
    return propagate(lambda natural: _predict(paper, equation, natural), settings)


@claim_check("optimum.eq28")
def optimum_of_equation(paper: Paper, claim: Claim) -> Recomputed:
    printed, at = printed_equation(paper), [s.value for s in _optimum(paper)]
    values = {term: cell.value for term, cell in printed.items()}

    def predict(numbers):
        return _predict(paper, dict(zip(printed, numbers, strict=True)), at)

    value, target = _predict(paper, values, at), paper.value("measured_angle_of_repose")
    return Recomputed(
        value,
        half_width=propagate(predict, list(printed.values())) + _setting_rounding(paper, values),
        disagrees=f"Eq. 28 misses the target by {abs(value - target):.2f} deg at the optimum: the "
        f"optimum was not "
        "found with Eq. 28 as printed.",
    )


@claim_check("optimum.regression")
def optimum_of_regression(paper: Paper, claim: Claim) -> Recomputed:
    equation = coefficients(model(paper))
    grid = np.linspace(-1, 1, 41)
    cube = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    angles = evaluate(equation, cube)
    target = paper.value("measured_angle_of_repose")
    band = number(paper.claims["validation.error"]).value / 100 * target
    near = cube[np.abs(angles - target) <= band]
    coding = _coding(paper)
    half = ((coding.high - coding.low) / 2).to_numpy()
    low, high = (coding.centre.to_numpy() + half * f(near, axis=0) for f in (np.min, np.max))
    ranges = ", ".join(
        f"{axis} {a:.3g} to {b:.3g}" for axis, a, b in zip(AXES, low, high, strict=True)
    )
    return Recomputed(
        _predict(paper, equation, [s.value for s in _optimum(paper)]),
        half_width=_setting_rounding(paper, equation),
        agrees=f"The optimum is this regression's, but not the only one: "
        f"{len(near) / len(cube):.0%} of the design "
        f"region comes within the validation's error of the target ({ranges}). One angle does not "
        f"fix three "
        "parameters.",
        disagrees="The regression misses the target at the stated optimum.",
    )
