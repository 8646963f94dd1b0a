"""Batches and instruments where experiments are emulated: the fit with the errors that they share
against direct linear algebra, and verdicts on closed forms."""

import re
from dataclasses import replace

import numpy as np
import pytest
from linear_model import Linear

from benchmarks.rates.simulated import rate_settings
from calibration.intake.measurements import Measurement
from diagnosis import held_out
from diagnosis.bulk import Bulk
from diagnosis.catalogue import load_catalogue
from diagnosis.design import inputs_of
from diagnosis.extend import gain, held_out_fits
from diagnosis.fit import data_of, fit
from diagnosis.laws.readings import shared_covariance
from diagnosis.model import Emulated
from diagnosis.page.markdown import page
from diagnosis.response import Response
from diagnosis.settings import BASE, parameters_of
from diagnosis.table_model.block import LAW
from diagnosis.verdict import extension, findings, validate

SETTINGS = rate_settings()
FACTORS = parameters_of(SETTINGS, "config/factors.tsv", ["heap", "shear"])
ANGLE, SHARE, REPLICATES = 1.0, 0.03, 5
"""Noise of one heap [deg] and of one shear test (a share); readings of a setting."""

LARGE = 4.0  # standard errors of a setting that a batch is off by


def heaps(values, batches=None, instruments=None):
    n = len(values)
    return [
        Measurement(
            "heap", v, ANGLE, REPLICATES, {"particle_diameter_mm": 3.0 + 0.1 * i}, batch=b,
            instrument=t,
        )
        for i, (v, b, t) in enumerate(
            zip(values, batches or [""] * n, instruments or [""] * n, strict=True)
        )
    ]  # fmt: skip


@pytest.fixture(name="linear")
def linear_case():
    """Model, measurements of three batches and two instruments, and their `Data`."""
    rng = np.random.default_rng(3)
    x = np.column_stack([np.ones(12), np.linspace(-1.0, 1.0, 12)])
    batches = [f"lot {k % 3}" for k in range(12)]
    off = dict(zip(sorted(set(batches)), (-2.0, 0.5, 2.0), strict=True))
    value = 30.0 + x @ [1.0, 2.0] + [off[b] for b in batches]
    value = value + ANGLE / np.sqrt(REPLICATES) * rng.standard_normal(12)
    own = heaps(value, batches, ["A", "B"] * 6)
    model = Linear(x)
    model.prior_mean[0] = 30.0
    return model, own, data_of(own)


def test_the_fit_takes_what_readings_share_as_its_inverse_says(linear):
    """Mode, residuals and left-out settings against solutions of the whole linear model."""
    model, own, data = linear
    shared = shared_covariance(own, np.full(12, 30.0), {("heap", "batch"): 0.07})
    data = replace(data, shared=shared)
    found = fit(model, data)
    by_theta = model.x @ np.diag(model.prior_sd**2) @ model.x.T
    total, mean = np.diag(data.error[0] ** 2) + shared + by_theta, model.x @ model.prior_mean
    inverse, off = np.linalg.inv(total), data.value[0] - mean
    theta = model.prior_mean + np.diag(model.prior_sd**2) @ model.x.T @ inverse @ off
    assert found.theta[0] == pytest.approx(theta, abs=1e-5)
    for i in range(len(off)):
        others = np.delete(np.arange(len(off)), i)
        alone = model.prior_mean + model.prior_sd**2 * (
            model.x[others].T @ np.linalg.solve(total[np.ix_(others, others)], off[others])
        )
        assert held_out_fits(model, data).theta[i] == pytest.approx(alone, abs=1e-4)
    # what is expected of the batches is what the readings without noise of their own would be
    assert found.common[0] == pytest.approx(shared @ inverse @ off, abs=1e-5)
    assert found.expected[0] + found.residual[0] * found.sd[0] == pytest.approx(data.value[0])


def test_rows_without_a_label_share_nothing():
    own = heaps([20.0] * 4, ["A", "A", "", ""])
    found = shared_covariance(own, np.full(4, 20.0), {("heap", "batch"): 0.1})
    assert found == pytest.approx(np.array([[4, 4, 0, 0], [4, 4, 0, 0], [0] * 4, [0] * 4]))


def test_an_error_of_a_logarithm_is_told_in_degrees_of_a_sliding_angle():
    """At 45 degrees the tangent changes by 2 % for 1 % of a radian."""
    rows = [Measurement("tilt", 45.0, 1.0, 5, {}, batch="A")]
    [[found]] = shared_covariance(rows, np.array([45.0]), {("tilt", "batch"): 0.02})
    assert np.sqrt(found) == pytest.approx(np.degrees(0.01))


def test_a_row_held_out_knows_the_error_of_its_batch():
    """Fifty readings of a batch tell its error; of another batch nothing but its spread is
    known."""
    rng = np.random.default_rng(7)
    emulated = closed_forms()
    [free] = plan(("lot 0",))[:1]
    model = emulated.model([free.condition])
    level = model.predict(model.prior_mean[None])[0][0, 0]
    off = {f"lot {k}": 3.0 * s for k, s in enumerate([1, -1, 1, -1])}
    own = [
        replace(free, value=level + off[b] + 0.4 * rng.standard_normal(), batch=b, line=k)
        for k, b in enumerate(list(off) * 12)
    ]
    known, new = (replace(free, value=level, batch=b) for b in ("lot 0", "lot 9"))
    bulk = Bulk(emulated, own)
    assert bulk.shared == {("heap", "batch"): pytest.approx(3.0 / level, rel=0.4)}
    rows = held_out.by_emulators(bulk, [known, new], bulk.judged(chance=(9,)))
    assert rows[0]["before"] - rows[1]["before"] == pytest.approx(3.0, abs=1.5)
    assert abs(rows[1]["miss_before"]) < 1.5
    assert abs(rows[0]["miss_before"]) > 3.0


def test_the_gain_counts_what_a_batch_shares_as_an_error():
    own = heaps([30.0 + 0.5 * k for k in range(6)], ["A", "B"] * 3)
    runs = np.array([[m.value + 2.0] * 3 for m in own])
    bare, wide = (gain(own, runs, runs, shared=s) for s in ({}, {("heap", "batch"): 0.07}))
    error = bare["points"][0]["error"]
    assert wide["points"][0]["error"] == pytest.approx(np.hypot(error, 0.07 * own[0].value))
    assert wide["held_out_rmse_before"] < 0.5 * bare["held_out_rmse_before"]


def closed_forms():
    """`Emulated` of heaps and shear cells in closed form: an angle of rolling friction, and of
    restitution, size, height and number a little; a friction of both frictions; cohesion adds to
    both over a grain's weight or the load."""
    forms = {
        "heap": lambda x: (
            26.0 + 9.0 * x[:, 0] - 2.0 * x[:, 1] - x[:, 2] - x[:, 3] + x[:, 4] + x[:, 0] * x[:, 2]
        ),
        "shear": lambda x: 0.4 + 0.2 * x[:, 0] + 0.1 * x[:, 1] + 0.02 * x[:, 2],
    }
    more = {
        "heap": lambda x: 8.0 * x[:, -1] * (1.0 - 0.8 * x[:, 2]),
        "shear": lambda x: 0.5 * x[:, -1] * 12.5 ** -x[:, 2],
    }
    rng, emulators = np.random.default_rng(2), {}
    for kind, form in forms.items():
        for name in (BASE, "cohesion"):
            x = rng.random((90, len(inputs_of(SETTINGS, FACTORS, kind, name))))
            z = form(x) + (more[kind](x) if name != BASE else 0.0)
            emulators[kind, name] = Response(x, z, [])
    catalogue = {n: m for n, m in load_catalogue().items() if n == "cohesion"}
    return Emulated(emulators, SETTINGS, FACTORS, catalogue)


def plan(batches=("lot 0", "lot 1", "lot 2"), instruments=("ring", "annulus")):
    """18 heaps of six sizes and 10 shear tests of five loads, values left open. Which lots and
    which instruments stand at a setting does not follow the levers."""
    rows = [
        Measurement(
            "heap", 0.0, ANGLE, REPLICATES,
            {"particle_diameter_mm": d, "discharge_height_mm": h}, line=2,
        )
        for d in (2.8, 3.1, 3.4, 3.8, 4.2, 4.6) for h in (60.0, 90.0, 130.0)
    ]  # fmt: skip
    rows = [
        replace(m, batch=batches[(k // 3 + k) % len(batches)], line=k + 2)
        for k, m in enumerate(rows)
    ]
    loads = [(s, t) for s in (0.4, 0.8, 1.5, 2.8, 5.0) for t in instruments]
    return rows + [
        Measurement(
            "shear", 0.0, SHARE, REPLICATES, {"normal_stress_kPa": s}, instrument=t, line=k + 20
        )
        for k, (s, t) in enumerate(loads)
    ]


def measured(emulated, seed, large, strength=0.0):
    """The plan measured: base parameters of the middle of their ranges, cohesion of a coded
    strength, and lots and instruments that are off by so many standard errors."""
    rng, rows = np.random.default_rng([seed, 77]), plan()
    model = emulated.model([m.condition for m in rows], ["cohesion"])
    theta = np.append(rng.uniform(-0.6, 0.6, len(FACTORS)), strength)
    true = model.predict(theta[None])[0][0]
    off = {m.batch + m.instrument: 0.0 for m in rows}
    off = dict(zip(off, rng.standard_normal(len(off)), strict=True))
    out = []
    for m, v in zip(rows, true, strict=True):
        noise = ANGLE if m.experiment == "heap" else SHARE * v
        v = v + large * noise / np.sqrt(REPLICATES) * off[m.batch + m.instrument]
        readings = v + noise * rng.standard_normal(REPLICATES)
        out.append(replace(m, value=readings.mean(), sd=readings.std(ddof=1)))
    return out


@pytest.fixture(scope="module", name="emulated")
def emulated_once():
    return closed_forms()


@pytest.mark.slow
def test_a_mechanism_is_found_beside_batch_error(emulated):
    for seed in range(200, 203):
        rows = measured(emulated, seed, LARGE, 0.7)
        bulk = Bulk(emulated, rows)
        found = bulk.judged()
        assert found.verdict == "identified"
        verdict = findings(bulk, found, extension(bulk, found), 0.05)
        validate(verdict)
        told = {(e["experiment"], e["of"]) for e in verdict["errors"]}
        assert told & {("heap", "batch"), ("shear", "instrument")}
        assert re.search(r"^## Errors beyond", page(verdict), re.M)


def test_terms_of_one_experiment_touch_no_other(emulated):
    rows = measured(emulated, 3, 0.0)
    [block] = Bulk(emulated, rows).block().values()
    kinds = np.array([m.experiment for m in rows])
    assert block.readings.experiments == list(dict.fromkeys(kinds))
    for term in block.terms.values():
        if term.kind != LAW:
            for shape in term.shapes:
                touched = np.abs(shape.root).any((0, 2))
                touched |= False if shape.mean is None else np.abs(shape.mean).any(0)
                assert not touched[kinds != term.experiment].any()
    law = block.terms["heap:attraction()"]
    assert law.more == {"experiments": ["heap", "shear"], "settings": len(rows)}
