"""Fits of the printed tables under the names that the paper gives their terms ("1", "A", "AB",
"A2")."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from calibration.statistics.surface import (
    Surface,
    fit_surface,
    model_matrix,
    quadratic_terms,
    term_name,
)

CODES = ["A", "B", "C"]


def key(name: str) -> str:
    """The paper's name of a term or source of `calibration.statistics.surface`."""
    return "1" if name == "Intercept" else name.replace("²", "2")


TERMS = {key(term_name(term)): term for term in quadratic_terms(CODES)}


def quadratic_matrix(levels: np.ndarray) -> np.ndarray:
    """The ten columns of the full quadratic model at coded `levels` (n, 3)."""
    return model_matrix(levels, CODES, list(TERMS.values()))


def fit_quadratic(
    levels: np.ndarray, response: np.ndarray, terms: tuple[str, ...] = tuple(TERMS)
) -> Surface:
    """Regression of `response` (n,) on coded `levels` (n, 3) with `terms`; raises as `fit_surface`
    does."""
    return fit_surface(
        pd.DataFrame(levels, columns=CODES), CODES, response, [TERMS[t] for t in terms]
    )


def coefficients(surface: Surface) -> dict[str, float]:
    """Coefficients by term."""
    return {
        key(term_name(term)): float(b) for term, b in zip(surface.terms, surface.beta, strict=True)
    }


def by_source(anova: pd.DataFrame) -> pd.DataFrame:
    """An analysis of variance indexed by the paper's names of its sources."""
    return anova.set_index(anova["source"].map(key))


def evaluate(equation: Mapping[str, float], levels: np.ndarray) -> np.ndarray:
    """Values (n,) of a quadratic equation, given by its coefficients, at coded `levels` (n, 3)."""
    return model_matrix(levels, CODES, [TERMS[t] for t in equation]) @ np.array(
        list(equation.values())
    )


def r_squared(y: np.ndarray, predicted: np.ndarray) -> float:
    """1 - residual over total sum of squares, of any curve."""
    return float(1 - np.sum((y - predicted) ** 2) / np.sum((y - y.mean()) ** 2))


def inverse_quadratic(curve: np.ndarray, y: float, low: float, high: float) -> float:
    """The x where the quadratic (highest power first) is y: the root nearest the middle of
    low..high; nan if none."""
    roots = np.roots(np.asarray(curve, float) - [0.0, 0.0, y])
    real = roots[np.isreal(roots)].real
    return float(real[np.argmin(np.abs(real - (low + high) / 2))]) if len(real) else float("nan")
