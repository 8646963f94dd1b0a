"""Emulators trained by known functions: derivatives, the scatter of runs apart from the error, and
the fit."""

import numpy as np
import pytest
from scipy.optimize import minimize

from benchmarks.rates.simulated import rate_settings
from calibration.intake.measurements import Measurement
from diagnosis import held_out
from diagnosis.bulk import Bulk
from diagnosis.catalogue import load_catalogue
from diagnosis.design import WIDENED, inputs_of
from diagnosis.emulator import scale_of
from diagnosis.fit import Data, fit
from diagnosis.lever_laws import AlongLever
from diagnosis.model import Emulated
from diagnosis.response import Response
from diagnosis.settings import BASE, parameters_of

SETTINGS = rate_settings()
FACTORS = parameters_of(SETTINGS, "config/factors.tsv", ["drop", "tilt"])
LAWS = [("drop", BASE), ("drop", "air_drag"), ("drop", "plastic_restitution"), ("tilt", BASE)]
CONDITIONS = [
    *[("drop", {"drop_height_mm": h, "particle_diameter_mm": 2.0, "output_interval_s": 0.04})
      for h in (60.0, 150.0, 350.0)],
    *[("tilt", {"tilt_rate_deg_s": w, "particle_diameter_mm": 2.0}) for w in (5.0, 18.0)],
]  # fmt: skip


def smooth(x):
    return 0.4 + 0.3 * x[:, 0] - 0.1 * x[:, 1] * x[:, -1] + 0.05 * np.sin(3.0 * x[:, 2])


@pytest.fixture(scope="module")
def emulated():
    rng, emulators = np.random.default_rng(5), {}
    for k, key in enumerate(LAWS):
        x = rng.random((40, len(inputs_of(SETTINGS, FACTORS, *key))))
        z = smooth(x) + 0.1 * k * x[:, -1] - (2.0 if key[0] == "drop" else 0.0)
        emulators[key] = Response(x, z, [])
    return Emulated(emulators, SETTINGS, FACTORS, load_catalogue())


def test_a_law_along_a_lever_moves_a_coefficient_of_the_base_model():
    rng = np.random.default_rng(1)
    x = rng.random((60, 3))
    base = Response(x, smooth(x), [1])
    law, at = AlongLever(base, 0, 1, -0.5, 0.9), rng.random((7, 4))
    moved = at[:, :3].copy()
    moved[:, 0] += (2.0 * at[:, 3] - 1.0) / WIDENED * (-0.5 + 0.9 * at[:, 1])
    assert law.predict(at)[0] == pytest.approx(base.predict(moved)[0])
    # without a strength the coefficient is where it is
    off = np.column_stack([at[:, :3], np.full(7, 0.5)])
    assert law.predict(off)[0] == pytest.approx(base.predict(at[:, :3])[0])


OF_BOTH_KINDS = ("apex_sampling", "plastic_restitution", "tilt_detection_lag")
"""Two that change the reading, and one that has an emulator."""


@pytest.mark.parametrize("names", [(), ("air_drag", "plastic_restitution"), OF_BOTH_KINDS])
def test_the_derivatives_of_a_model_are_those_of_its_predictions(emulated, names):
    model = emulated.model(CONDITIONS, names)
    theta = np.array([model.prior_mean + 0.1, model.prior_mean - 0.2])
    (_, error), slope = model.predict(theta), model.slope(theta)
    for k in range(theta.shape[1]):
        step = 1e-4 * np.eye(theta.shape[1])[k]
        central = (model.predict(theta + step)[0] - model.predict(theta - step)[0]) / 2e-4
        assert slope[:, :, k] == pytest.approx(central, rel=0.01, abs=1e-3)
    assert (error > 0.0).all()


def test_a_fit_finds_the_parameters_that_made_the_data(emulated):
    model = emulated.model(CONDITIONS, ["air_drag"])
    rng = np.random.default_rng(3)
    truth = np.column_stack([rng.uniform(-0.6, 0.6, (20, 2)), rng.uniform(0.2, 0.8, 20)])
    value = model.predict(truth)[0]
    found = fit(model, Data(value, 1e-3 * value))
    assert found.chi_square.max() < 1.0
    # within four standard deviations of the posterior, the prior's pull included
    sd = np.sqrt(np.einsum("bpp->bp", found.cov))
    assert (np.abs(found.theta - truth) < 4.0 * sd).all()


@pytest.mark.parametrize("names", [(), ("air_drag",)])
def test_a_fit_slides_along_a_bound_that_the_data_push_it_beyond(emulated, names):
    model = emulated.model(CONDITIONS, names)
    rng = np.random.default_rng(8)
    truth = np.tile(model.prior_mean, (12, 1)) + rng.uniform(-0.3, 0.3, (12, len(model.names)))
    truth[:, 0] = rng.choice([-1.6, 1.6], 12)
    value = model.predict(truth)[0]
    data = Data(value, 0.01 * np.abs(value))
    found = fit(model, data)
    assert (np.abs(found.theta[:, 0]) == 1.15).sum() >= 6

    bounds = list(zip(model.low, model.high, strict=True))
    for i in range(12):
        sd = found.sd[i]

        def cost(theta, i=i, sd=sd):
            r = (data.value[i] - model.predict(theta[None])[0][0]) / sd
            return (r**2).sum() + (((theta - model.prior_mean) / model.prior_sd) ** 2).sum()

        starts = [found.theta[i], np.clip(truth[i], model.low, model.high)]
        best = min(minimize(cost, t, bounds=bounds, method="L-BFGS-B").fun for t in starts)
        assert cost(found.theta[i]) == pytest.approx(best, rel=0.01, abs=0.1)


def test_scatter_from_seed_to_seed_is_no_error_of_the_mean():
    rng = np.random.default_rng(4)
    x, at = rng.random((80, 2)), rng.random((200, 2))
    noisy = smooth(np.column_stack([x, x])) + 0.05 * rng.standard_normal(len(x))
    found = Response(x, noisy, [])
    assert found.scatter == pytest.approx(0.05, rel=0.25)
    truth = smooth(np.column_stack([at, at]))
    miss = np.sqrt(np.mean((found.predict(at)[0] - truth) ** 2))
    stated = np.sqrt(found.predict(at)[1].mean())
    assert miss == pytest.approx(stated, rel=0.5)


def test_a_quantity_known_to_a_share_of_itself_is_learned_in_its_logarithm():
    """Poured density declares no scale; a stress goes with its load, an angle stays as it is."""
    value = np.array([1.5, 400.0])
    z = scale_of("bulk_density").forward(value, {})
    assert z == pytest.approx(np.log(value))
    back, slope = scale_of("bulk_density").inverse(z, {})
    assert back == pytest.approx(value)
    assert slope == pytest.approx(value)
    assert scale_of("heap").forward(value, {}) == pytest.approx(value)
    levers = {"normal_stress_kPa": np.array([2.0, 4.0])}
    assert scale_of("shear").forward(value, levers) == pytest.approx([0.75, 100.0])


def test_rows_held_out_are_predicted_by_the_fit_to_the_others(emulated):
    """One experiment is held out in part, another has rows that nothing was fitted to."""
    model = emulated.model(CONDITIONS)
    value = model.predict(np.array([[0.3, -0.2]]))[0][0]
    rows = [Measurement(e, v, 0.01 * v, 5, x) for (e, x), v in zip(CONDITIONS, value, strict=True)]
    fitted, held = rows[:2] + rows[3:], rows[2:3]
    bulk = Bulk(emulated, fitted)
    [row] = held_out.by_emulators(bulk, held, bulk.judged(chance=(9,)))
    assert row["before"] == pytest.approx(held[0].value, rel=0.02)
    assert row["after"] is None
    drops = [m for m in rows if m.experiment == "drop"]
    bulk = Bulk(emulated, drops)
    [none] = held_out.by_emulators(bulk, rows[3:4], bulk.judged(chance=(9,)))
    assert none["before"] is None
