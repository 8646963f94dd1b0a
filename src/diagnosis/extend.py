"""Runs of the real engine that check what was found: the gain of the extended model on settings
that it was not fitted to, and what a finer time step changes.

Nature has no time step, so a coarse one is no mechanism that data could show. It is halved at one
condition of each experiment, that in the middle of the measured ones, with the calibrated base
model and the same seeds.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import expit
from scipy.stats import norm, t

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES
from calibration.runs.simulated import named
from dem.errors import SpecError
from dem.spec import parse_spec
from diagnosis.catalogue import Mechanism
from diagnosis.fit import Data, Fit, data_of, fit
from diagnosis.laws.readings import shared_covariance
from diagnosis.model import Model
from diagnosis.reading_errors import doubt, spread_unit
from diagnosis.rig import Rig
from diagnosis.settings import Settings

FIT = 3.0
"""Root mean square miss at left-out settings, in all errors, above which a name is withdrawn."""

RESAMPLES = 4000
LEAST_RUNS = 2  # at a setting: one does not tell how much runs scatter


def held_out_fits(model: Model, data: Data) -> Fit:
    """`Fit` of n data sets, each one set of `Data` without one of its n readings. The tests without
    a value stay, as they stand in the fit to all."""
    n = data.value.shape[1]
    error = np.tile(data.error, (n, 1))
    error[np.arange(n), np.arange(n)] = 1e9  # a setting with no weight is a setting left out
    failed = None if data.failed is None else np.tile(data.failed, (n, 1))
    return fit(model, replace(data, value=np.tile(data.value, (n, 1)), error=error, failed=failed))


def refit_errors(model: Model, data: Data, fits: Fit) -> np.ndarray:
    """Standard errors (n,) that refitted parameters leave in what the engine gives at each of n
    readings, which the fit of its own in `fits` (n data sets) had not seen; in the readings' units.

    The parameters follow the errors of the other readings and of the emulators there, which err
    alike at settings that are alike. With J the slopes, W the weights of the fit, S the covariance
    of these errors, T the information of tests without a value and P the prior's covariance, the
    parameters scatter by H^-1 (J'WSWJ + T + P^-1) H^-1 with H = J'WJ + T + P^-1 (Huber 1967, Proc.
    Fifth Berkeley Symp. 1:221). A misfit widens nothing: a wrong law would else excuse itself."""
    (_, emulator), slope = model.predict(fits.theta), model.slope(fits.theta)
    known = information(model, data, fits.theta) + np.diag(1.0 / model.prior_sd**2)
    out = np.zeros(len(fits.theta))
    for i, theta in enumerate(fits.theta):
        others = np.arange(len(out)) != i
        free = (theta > model.low) & (theta < model.high)
        own = np.diag(data.error[0] ** 2)
        own = own if data.shared is None else own + data.shared
        alike = model.error_correlation(theta) if emulator[i].any() else 1.0
        fitted = (own + np.diag(emulator[i] ** 2))[np.ix_(others, others)]
        true = (own + np.outer(emulator[i], emulator[i]) * alike)[np.ix_(others, others)]
        j = slope[i][np.ix_(others, free)]
        weighted, left = np.linalg.solve(fitted, j), known[i][np.ix_(free, free)]
        pull = np.linalg.solve(j.T @ weighted + left, slope[i, i, free])
        out[i] = np.sqrt(pull @ (weighted.T @ true @ weighted + left) @ pull)
    return out


def information(model: Model, data: Data, points: np.ndarray) -> np.ndarray:
    """Fisher information (n, p, p) that tests without a value give of the parameters."""
    if data.failed is None:
        return np.zeros((len(points), points.shape[1], points.shape[1]))
    odds, by_theta = model.odds(points)
    chance = expit(odds)
    return np.einsum("bc,bcp,bcq->bpq", data.tests * chance * (1.0 - chance), by_theta, by_theta)


def within(
    budget: int, models: int, measurements: Sequence[Measurement], most: int
) -> tuple[int, list[int]]:
    """(runs at each setting, places of the settings that are run) of `models` models within a
    budget of runs, at most `most` at each.

    Fewer runs first, then fewer settings, spread over each experiment's levels. No setting is run
    where the budget is too small for three."""
    places = sorted(
        range(len(measurements)),
        key=lambda i: (measurements[i].experiment, sorted(measurements[i].levers.items())),
    )
    if models == 0:
        return most, sorted(places)
    runs = int(np.clip(budget // (models * len(places)), LEAST_RUNS, most))
    count = min(budget // (models * runs), len(places))
    if count < 3:
        return runs, []
    chosen = np.linspace(0, len(places) - 1, count).round().astype(int)
    return runs, sorted(places[i] for i in chosen)


def extension_plan(
    rig: Rig,
    models: Mapping[str, Model],
    measurements: Sequence[Measurement],
    data: Data,
    places: Collection[int] | None = None,
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
    """`gain_runs` runs of each model at the parameters fitted without each setting, at that
    setting; at those in `places` alone where it is given, and at none where a model cannot
    be run.

    models: {label: Model}; data: the `Data` that they were fitted to.
    Returns rows [{label, setting, theta, refit, run_ids, reads}] and {run id: spec}; refit: of
    `refit_errors`; reads: {mechanism of the reading: strength}.
    """
    rows: list[dict[str, Any]] = []
    specs, refused = {}, set()  # type: ignore[var-annotated]
    for label, model in models.items():
        fits = held_out_fits(model, data)
        refit = refit_errors(model, data, fits)
        for i, theta in enumerate(fits.theta):
            if places is not None and i not in places:
                continue
            seeds = [90_000 + i + 1000 * k for k in range(rig.settings.gain_runs)]
            try:
                own = named([real_spec(rig, model, measurements[i], theta, s) for s in seeds])
            except SpecError:
                refused.add(i)  # larger grains, say, that do not fit the rig
                continue
            specs |= own
            rows.append(
                {
                    "label": label,
                    "setting": i,
                    "theta": [float(v) for v in theta],
                    "refit": float(refit[i]),
                    "run_ids": list(own),
                    "reads": {
                        m.name: float(m.strength.natural(theta[k]))
                        for k, m in enumerate(model.mechanisms, len(model.factors))
                        if m.observe is not None and measurements[i].experiment in m.experiments
                    },
                }
            )
    rows = [row for row in rows if row["setting"] not in refused]
    return rows, {name: specs[name] for row in rows for name in row["run_ids"]}


def real_spec(
    rig: Rig, model: Model, measurement: Measurement, theta: np.ndarray, seed: int
) -> dict[str, Any]:
    """Run spec of a condition at theta (p,), the engine's laws of the model's mechanisms switched
    on."""
    values = {f.name: f.natural(float(t)) for f, t in zip(model.factors, theta, strict=False)}
    spec = replace(rig, factors=tuple(model.factors)).spec(measurement.condition, seed, values)
    for k, mechanism in enumerate(model.mechanisms, len(model.factors)):
        if mechanism.observe is None and measurement.experiment in mechanism.experiments:
            spec = mechanism.apply(spec, round(float(mechanism.strength.natural(theta[k])), 12))
    return spec


def real_values(
    settings: Settings,
    catalogue: Mapping[str, Mechanism],
    measurements: Sequence[Measurement],
    rows: Sequence[Mapping[str, Any]],
    metrics: Mapping[str, Mapping[str, float] | None],
) -> dict[str, np.ndarray]:
    """{label: values (n, r)} of the runs of rows as the n measurements would have read them; nan
    where a run failed or there is none."""
    shape = len(measurements), max(len(row["run_ids"]) for row in rows)
    out = {row["label"]: np.full(shape, np.nan) for row in rows}
    for row in rows:
        m = measurements[row["setting"]]
        for r, name in enumerate(row["run_ids"]):
            if metrics[name] is not None:
                value = metrics[name][settings.experiments[m.experiment].metric]  # type: ignore[index]
                for mechanism, strength in row["reads"].items():
                    value = catalogue[mechanism].observe(value, m.levers, strength)  # type: ignore[misc]
                out[row["label"]][row["setting"], r] = value
    return out


def run_scatter(measurements: Sequence[Measurement], values: np.ndarray) -> np.ndarray:
    """Standard errors (n,) of the means of `values` (n, r): pooled over the settings of an
    experiment.

    The scatter is relative for drop and shear, absolute for angles.
    """
    unit = spread_unit(measurements)
    kinds = np.array([m.experiment for m in measurements])
    count = np.isfinite(values).sum(1)
    deviation = (values - np.nanmean(values, axis=1, keepdims=True)) / unit[:, None]
    out = np.zeros(len(unit))
    for kind in set(kinds):
        rows = (kinds == kind) & (count > 1)
        pooled = np.nansum(deviation[rows] ** 2) / max((count[rows] - 1).sum(), 1)
        out[kinds == kind] = np.sqrt(pooled / np.maximum(count[kinds == kind], 1))
    return out * unit


def _as_known(measurements, values):
    """Factor (n,) on `run_scatter` by which a spread that few runs tell is as likely to be passed
    FIT times as one that is known: by Student's t over the normal law there."""
    kinds, count = np.array([m.experiment for m in measurements]), np.isfinite(values).sum(1)
    out = np.ones(len(kinds))
    for kind in set(kinds):
        freedom = np.maximum(count[kinds == kind] - 1, 0).sum()
        if freedom:
            out[kinds == kind] = t.isf(norm.sf(FIT), freedom) / FIT
    return out


def gain(
    measurements: Sequence[Measurement],
    before: np.ndarray,
    after: np.ndarray,
    shared: Mapping[tuple[str, str], float] | None = None,
    refit: np.ndarray | None = None,
) -> dict[str, Any] | None:
    """Error on left-out settings before and after, with the 95 % bootstrap interval of what is
    gained; None where no setting could be run.

    before, after: (n, r) values of r runs of the real engine. Errors are in standard errors of the
    measurement and of the mean of the runs together, and of what its batch and its instrument share
    (`shared`, as `Bulk` has it), which no run tells. The bootstrap resamples settings, the same for
    both models. refit: (n,) of `refit_errors` of the extended model.
    `held_out_rmse_after_all_errors` counts them too, and that few runs tell their scatter poorly:
    one setting of a model that is right exceeds FIT in 0.3 % of data, several less often.
    """
    data = data_of(measurements)
    common = np.diag(shared_covariance(measurements, data.value[0], shared or {}))
    errors = np.sqrt(data.error[0] ** 2 + common)
    good = np.isfinite(before).any(1) & np.isfinite(after).any(1)
    if not good.any():
        return None
    kept = [m for m, g in zip(measurements, good, strict=True) if g]
    value, error = data.value[0][good], errors[good]
    means = [np.nanmean(v[good], axis=1) for v in (before, after)]
    spread = [np.hypot(error, run_scatter(kept, v[good])) for v in (before, after)]
    miss = [(value - m) / s for m, s in zip(means, spread, strict=True)]
    runs = run_scatter(kept, after[good]) * _as_known(kept, after[good])
    left = np.zeros(len(kept)) if refit is None else refit[good]
    whole = (value - means[1]) / np.sqrt(error**2 + runs**2 + left**2)

    def rmse(miss):
        return np.sqrt((miss**2).mean(-1))

    pick = np.random.default_rng(0).integers(len(kept), size=(RESAMPLES, len(kept)))
    # positive where the extended model is better
    ends = np.quantile(rmse(miss[0][pick]) - rmse(miss[1][pick]), [0.025, 0.975])
    kinds, by_experiment = np.array([m.experiment for m in kept]), {}
    for kind in dict.fromkeys(kinds):
        off = [float(rmse((value - m)[kinds == kind])) for m in means]
        row = {"before": off[0], "after": off[1], "unit": QUANTITIES[kind].unit}
        by_experiment[str(kind)] = row
    points = [
        {
            "experiment": m.experiment,
            "levers": m.levers,
            "measured": m.value,
            "error": float(error[i]),
            "before": float(means[0][i]),
            "after": float(means[1][i]),
            "miss_before": float(miss[0][i]),
            "miss_after": float(miss[1][i]),
            "refit": float(left[i]),
        }
        for i, m in enumerate(kept)
    ]
    return {
        "settings": len(kept),
        "without_value": len(measurements) - len(kept),
        "rmse_unit": "standard errors of measurement and simulation",
        "held_out_rmse_before": float(rmse(miss[0])),
        "held_out_rmse_after": float(rmse(miss[1])),
        "held_out_rmse_difference_interval": [float(v) for v in ends],
        "held_out_rmse_after_all_errors": float(rmse(whole)),
        "by_experiment": by_experiment,
        "points": points,
    }


LARGE = 0.5
"""Change over the standard error of the measurement, from which on a coarser step would be seen."""

SURE = 2.0  # standard errors of the runs' mean by which the change must stand out of their scatter


def halved(spec: dict[str, Any]) -> dict[str, Any]:
    """Run spec (a mapping) at half its time step."""
    own = parse_spec(spec).numerics
    if own.time_step_s is not None:
        finer = {"time_step_s": 0.5 * own.time_step_s}
    else:
        finer = {"rayleigh_fraction": 0.5 * own.rayleigh_fraction}
    return spec | {"numerics": spec.get("numerics", {}) | finer}


def middles(measurements: Sequence[Measurement]) -> list[int]:
    """Places of the measurements that are checked: the middle one of each experiment by value."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [i for i, m in enumerate(measurements) if m.experiment == kind]
        own.sort(key=lambda i: measurements[i].value)
        out.append(own[len(own) // 2])
    return out


def time_step_plan(
    rig: Rig,
    model: Model,
    theta: np.ndarray,
    measurements: Sequence[Measurement],
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
    """Rows [{label, setting, run_ids, reads}], `full` and `half` of each setting, and {run id:
    spec}, of the base model at theta (p,)."""
    rows: list[dict[str, Any]] = []
    specs: dict[str, dict[str, Any]] = {}
    for i in middles(measurements):
        seeds = [95_000 + 1000 * k for k in range(rig.settings.gain_runs)]
        full = [real_spec(rig, model, measurements[i], theta, s) for s in seeds]
        for label, own in (("full", full), ("half", [halved(s) for s in full])):
            runs = named(own)
            specs |= runs
            rows.append({"label": label, "setting": i, "run_ids": list(runs), "reads": {}})
    return rows, specs


def time_step_check(
    settings: Settings,
    measurements: Sequence[Measurement],
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, dict[str, float] | None],
) -> list[dict[str, Any]]:
    """[{experiment, levers, value, half, change, uncertain, error, matters}] of what could be run:
    means, their difference, its standard error, that of the measurement."""
    out, errors = [], data_of(measurements).error[0]
    values = real_values(settings, {}, measurements, rows, metrics)
    for i in dict.fromkeys(row["setting"] for row in rows):
        m, pair = measurements[i], np.array([values["full"][i], values["half"][i]])
        if not np.isfinite(pair).any(1).all():
            continue
        full, half = map(float, np.nanmean(pair, axis=1))
        known = np.isfinite(pair).sum() - 2.0  # of few runs
        uncertain = float(np.hypot(*run_scatter([m] * 2, pair)) * doubt(np.maximum(known, 1.0)))
        matters = abs(half - full) - SURE * uncertain > LARGE * errors[i]
        row = {"experiment": m.experiment, "levers": m.levers, "value": full, "half": half}
        row |= {"change": half - full, "uncertain": uncertain, "error": float(errors[i])}
        out.append(row | {"matters": bool(matters)})
    return out
