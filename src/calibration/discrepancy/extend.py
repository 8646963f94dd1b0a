"""The gain of the extended model, measured with the real engine on settings that it was not fitted to."""

import numpy as np

from calibration.discrepancy.fit import Data, data_of, fit
from calibration.discrepancy.runs import named
from calibration.discrepancy.settings import condition_spec

RESAMPLES = 4000


def held_out_points(model, measurements):
    """(n, p) posterior modes, each fitted without one setting."""
    data = data_of(measurements)
    n = len(measurements)
    error = np.tile(data.error, (n, 1))
    error[np.arange(n), np.arange(n)] = 1e9  # a setting with no weight is a setting left out
    return fit(model, Data(np.tile(data.value, (n, 1)), error)).theta


def extension_plan(settings, base, models, measurements, seed=90_000):
    """Runs of each model at the parameters fitted without each setting, at that setting.

    models: {label: Model}. Returns rows [{label, setting, theta, run_id}] and {run id: spec}.
    """
    rows, specs = [], {}
    for label, model in models.items():
        for i, theta in enumerate(held_out_points(model, measurements)):
            m = measurements[i]
            spec = real_spec(settings, base, model, m, theta, seed + i)
            [(name, spec)] = named([spec]).items()
            specs[name] = spec
            rows.append(
                {"label": label, "setting": i, "theta": [float(t) for t in theta], "run_id": name}
            )
    return rows, specs


def real_spec(settings, base, model, measurement, theta, seed):
    """Run spec of a condition at theta (p,), the engine's laws of the model's mechanisms switched on."""
    values = {f.name: f.natural(float(t)) for f, t in zip(model.factors, theta, strict=False)}
    spec = condition_spec(
        base, settings, model.factors, measurement.experiment, measurement.levers, values, seed
    )
    for k, mechanism in enumerate(model.mechanisms, len(model.factors)):
        if mechanism.observe is None and measurement.experiment in mechanism.experiments:
            spec = mechanism.apply(spec, round(float(mechanism.strength.natural(theta[k])), 12))
    return spec


def real_values(settings, model, measurements, rows, metrics):
    """(n,) values as the measurement would have read them; nan where the run failed."""
    out = np.full(len(measurements), np.nan)
    for row in rows:
        m = measurements[row["setting"]]
        if metrics[row["run_id"]] is None:
            continue
        value = metrics[row["run_id"]][settings.experiments[m.experiment].metric]
        for k, mechanism in enumerate(model.mechanisms, len(model.factors)):
            if mechanism.observe is not None and m.experiment in mechanism.experiments:
                value = mechanism.observe(
                    value, m.levers, mechanism.strength.natural(row["theta"][k])
                )
        out[row["setting"]] = value
    return out


def gain(measurements, before, after, seed=0):
    """Held-out error before and after in units of the measurements' standard errors, with 95 % bootstrap intervals.

    before, after: (n,) values of the real engine. The bootstrap resamples settings, the same for both models.
    """
    data = data_of(measurements)
    good = np.isfinite(before) & np.isfinite(after)
    miss = [(data.value[0] - v)[good] / data.error[0][good] for v in (before, after)]
    rng = np.random.default_rng(seed)
    pick = rng.integers(good.sum(), size=(RESAMPLES, int(good.sum())))
    rmse = [np.sqrt((m[pick] ** 2).mean(1)) for m in miss]
    # log density of a setting with the spread that each model's own misses ask for
    score = [_log_score(m) for m in miss]
    by = {}
    kinds = np.array([m.experiment for m in measurements])[good]
    for kind in dict.fromkeys(kinds):
        raw = [np.sqrt(np.mean((m * data.error[0][good])[kinds == kind] ** 2)) for m in miss]
        by[kind] = {"before": float(raw[0]), "after": float(raw[1])}
    return {
        "settings": int(good.sum()),
        "held_out_rmse_before": float(np.sqrt((miss[0] ** 2).mean())),
        "held_out_rmse_before_interval": _interval(rmse[0]),
        "held_out_rmse_after": float(np.sqrt((miss[1] ** 2).mean())),
        "held_out_rmse_after_interval": _interval(rmse[1]),
        "held_out_rmse_difference_interval": _interval(rmse[0] - rmse[1]),
        "held_out_chi_square_before": float((miss[0] ** 2).sum()),
        "held_out_chi_square_after": float((miss[1] ** 2).sum()),
        "held_out_log_score_before": float(score[0].sum()),
        "held_out_log_score_after": float(score[1].sum()),
        "held_out_log_score_difference_interval": _interval((score[1] - score[0])[pick].sum(1)),
        "rmse_unit": "standard errors of the measurements",
        "by_experiment": by,
    }


def _log_score(miss):
    scale = max(float(np.sqrt((miss**2).mean())), 1.0)
    return -0.5 * (miss / scale) ** 2 - np.log(scale)


def _interval(sample):
    return [float(v) for v in np.quantile(sample, [0.025, 0.975])]
