"""Least squares and its analysis of variance as Design-Expert prints it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import statsmodels.api as sm
from scipy import stats


@dataclass(frozen=True)
class Fit:
    """Least-squares fit of `response` (n,) to `terms` (n, p), whose first column is the intercept "1"."""

    terms: pd.DataFrame
    response: np.ndarray

    @cached_property
    def ols(self):
        """The statsmodels result."""
        return sm.OLS(self.response, self.terms.to_numpy(float)).fit()

    @property
    def coefficients(self) -> pd.Series:
        """Coefficients by term, in the response's unit."""
        return pd.Series(self.ols.params, index=self.terms.columns)

    @cached_property
    def anova(self) -> pd.DataFrame:
        """Sum of squares (each term's given all others), df, mean square, F and p, by source."""
        ols = self.ols
        sum_sq = dict(
            zip(self.terms.columns[1:], (ols.tvalues[1:] ** 2) * ols.mse_resid, strict=True)
        )
        rows = [("Model", ols.ess, ols.df_model), *((term, ss, 1.0) for term, ss in sum_sq.items())]
        table = pd.DataFrame(rows, columns=["source", "sum_sq", "df"]).set_index("source")
        table["mean_sq"] = table.sum_sq / table.df
        table["F"] = table.mean_sq / ols.mse_resid
        table["p"] = stats.f.sf(table.F, table.df, ols.df_resid)
        table.loc["Residual"] = [ols.ssr, ols.df_resid, ols.mse_resid, np.nan, np.nan]
        self._add_lack_of_fit(table)
        table.loc["Cor Total"] = [
            ols.centered_tss,
            ols.df_model + ols.df_resid,
            np.nan,
            np.nan,
            np.nan,
        ]
        return table

    def _add_lack_of_fit(self, table: pd.DataFrame) -> None:
        """Split the residual by the replicated points, where there are any."""
        groups = pd.Series(self.response).groupby(
            [self.terms[c].to_numpy() for c in self.terms.columns[1:]]
        )
        pure, df = (
            float(((self.response - groups.transform("mean")) ** 2).sum()),
            len(self.response) - groups.ngroups,
        )
        if df == 0:
            return
        lack, lack_df = self.ols.ssr - pure, self.ols.df_resid - df
        f = (lack / lack_df) / (pure / df)
        table.loc["Lack of Fit"] = [lack, lack_df, lack / lack_df, f, stats.f.sf(f, lack_df, df)]
        table.loc["Pure Error"] = [pure, df, pure / df, np.nan, np.nan]

    @cached_property
    def summary(self) -> dict[str, float]:
        """R2, R2_adj, R2_pred (from PRESS), CV_percent and adequate_precision."""
        ols = self.ols
        press = float(np.sum((ols.resid / (1 - ols.get_influence().hat_matrix_diag)) ** 2))
        n, p = self.terms.shape
        return {
            "R2": ols.rsquared,
            "R2_adj": ols.rsquared_adj,
            "R2_pred": 1 - press / ols.centered_tss,
            "CV_percent": 100 * np.sqrt(ols.mse_resid) / self.response.mean(),
            "adequate_precision": np.ptp(ols.fittedvalues) / np.sqrt(p * ols.mse_resid / n),
        }


def linear_terms(coded: pd.DataFrame) -> pd.DataFrame:
    """Intercept and the columns of `coded`."""
    return pd.concat([pd.Series(1.0, index=coded.index, name="1"), coded.astype(float)], axis=1)


def quadratic_terms(coded: np.ndarray) -> pd.DataFrame:
    """The ten terms of the full quadratic model in A, B, C for `coded` (n, 3)."""
    a, b, c = np.asarray(coded, float).T
    columns = {"1": np.ones_like(a), "A": a, "B": b, "C": c, "AB": a * b, "AC": a * c, "BC": b * c}
    return pd.DataFrame(columns | {"A2": a * a, "B2": b * b, "C2": c * c})


def r_squared(y: np.ndarray, predicted: np.ndarray) -> float:
    """1 - residual over total sum of squares, of any curve."""
    return float(1 - np.sum((y - predicted) ** 2) / np.sum((y - y.mean()) ** 2))


def inverse_quadratic(coefficients: np.ndarray, y: float, low: float, high: float) -> float:
    """The x where the quadratic (highest power first) is y: the root nearest the middle of low..high; nan if none."""
    roots = np.roots(np.asarray(coefficients, float) - [0.0, 0.0, y])
    real = roots[np.isreal(roots)].real
    return float(real[np.argmin(np.abs(real - (low + high) / 2))]) if len(real) else float("nan")
