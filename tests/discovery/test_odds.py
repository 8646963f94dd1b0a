"""Odds of one model against another, by the closed form of linear ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_model import Linear
from scipy.stats import multivariate_normal

from diagnosis.fit import Data, fit
from diagnosis.identify import odds_of


def test_odds_of_two_linear_models_are_those_of_their_marginal_normals():
    rng = np.random.default_rng(5)
    designs = {"one": rng.normal(size=(6, 1)), "two": rng.normal(size=(6, 3))}
    models = {name: Linear(x) for name, x in designs.items()}
    value, error = rng.normal(size=(1, 6)), np.full((1, 6), 1.5)
    data = Data(value, error)
    fits = {name: fit(model, data) for name, model in models.items()}
    assert all(f.scale.max() == 1.0 for f in fits.values())  # the closed form has no misfit
    exact = {
        name: multivariate_normal(
            x @ np.full(x.shape[1], 0.5), 4.0 * x @ x.T + 1.5**2 * np.eye(6)
        ).logpdf(value[0])
        for name, x in designs.items()
    }
    found = SimpleNamespace(models=models, fits=fits, data=data)
    assert odds_of(found, "one", "two") == pytest.approx(exact["one"] - exact["two"], abs=1e-3)
