"""The diagnosis of drops and slides alone: each is one contact, which the engine integrates, so
nothing is trained.

The base model is a constant restitution and a constant friction. What it misses is looked for by
`diagnosis.laws`."""

import numpy as np

from calibration.figures import parameter_words
from calibration.intake.quantities import Condition
from calibration.statistics.numbers import NORMAL_95
from dem.spec import parse_spec
from diagnosis import time_step
from diagnosis.chance import share_above
from diagnosis.collision import rebounds, sliding_angles
from diagnosis.fit import data_of, redrawn_error
from diagnosis.laws.engine_gain import Nested
from diagnosis.laws.found import discover, predictions
from diagnosis.laws.known import COEFFICIENT, known_curves, with_coefficient
from diagnosis.laws.mixed import LEVEL_SD
from diagnosis.laws.readings import FREE, IN_AIR, from_log, readings_of
from diagnosis.power import power
from diagnosis.residuals import by_chance, tails, trends


def _known(rig, catalogue):
    """The catalogue's curves, as `diagnosis.laws.choose.trial` takes them."""

    def spec_of(experiment, levers):
        return rig.spec(Condition(experiment, levers), rig.settings.seed)

    return [known_curves(catalogue, spec_of)]


def power_of(measurements, rig, catalogue):
    """Rows of `diagnosis.power.power` for a plan."""
    settings, kinds = rig.settings, {m.experiment for m in measurements}
    known, defaults = _known(rig, catalogue), defaults_of(settings, kinds)
    return power(measurements, known, catalogue, settings.alpha, settings.seed, defaults)


def discovered(measurements, rig, catalogue):
    """`diagnosis.laws.found.Found` of the drops, slides and shear tests among the measurements, or
    None."""
    settings = rig.settings
    return discover(
        measurements,
        _known(rig, catalogue),
        settings.alpha,
        settings.seed,
        defaults_of(settings, {m.experiment for m in measurements}),
    )


def nested(measurements, found, rig, catalogue):
    """`diagnosis.laws.engine_gain.Nested` of a `Found` that has a law."""
    return Nested(found, measurements, rig, _known(rig, catalogue), catalogue)


def defaults_of(settings, experiments):
    """{experiment: {lever: value}} of the levers that rows may leave empty."""
    return {kind: _defaults(settings, kind) for kind in set(experiments) & set(FREE)}


def _defaults(settings, kind):
    """{lever: value} of the levers that rows may leave empty."""
    run = settings.experiments[kind].run
    found = {
        "particle_diameter_mm": run.get("particles", {}).get("diameter_mm"),
        "tilt_rate_deg_s": run.get("geometry", {}).get("tilt_rate_deg_s"),
    }
    own = {"drop": ("particle_diameter_mm",), "tilt": tuple(found)}.get(kind, ())
    return {name: found[name] for name in own if found[name] is not None}


def findings(measurements, found, settings, factors):
    """The mapping of verdict.json from a `Found`, the gain left open."""
    ranking = [
        {"mechanism": r["mechanism"], "score": r["gain"], "gain": r["gain"], "p": r["p"]}
        | {"null_threshold": r["threshold"], "p_family": found.p}
        for r in found.ranking
    ]
    return base(measurements, settings, factors, found) | {
        "verdict": found.verdict,
        "causes": found.causes,
        "reason": found.reason,
        "family_p": found.p,
        "tried": sum(len(t.candidates) for t in found.trials.values()),
        "threshold_level": settings.alpha,
        "null_threshold_best": found.threshold,
        "ranking": ranking,
        "law": found.law,
        "scatter": found.scatter,
        "outliers": found.outliers,
        "gain": None,
        "next_measurement": found.next_setting,
    }


def base(measurements, settings, factors, found=None):
    """The constants fitted to the measurements: calibration, lack_of_fit, patterns and residuals.

    found: the `Found` of the measurements, whose outliers and shared errors then count; None before
    any law is looked for."""
    levels = {kind: _level(measurements, kind, found) for kind in _kinds(measurements)}
    stated = data_of(measurements).error[0]
    drawn = by_chance(measurements, stated, stated)
    rows = _rows(measurements, levels)
    off = np.array([r["standardised"] for r in rows])
    for row, tail in zip(rows, tails(measurements, drawn, off), strict=True):
        row["predictive_p"] = float(tail)
    kept = _kept(measurements, found.trials if found else {})
    return {
        "calibration": _calibration(settings, factors, levels),
        "lack_of_fit": misfit_of(kept, settings.replicates, settings.seed),
        "patterns": trends(rows, drawn),
        "residuals": rows,
    }


def _kept(measurements, trials):
    """The measurements without those that the trials set aside."""
    rows = {int(i) for trial in trials.values() for i in trial.readings.rows}
    return [m for i, m in enumerate(measurements) if i in rows or m.experiment not in trials]


def misfit_of(measurements, replicates, seed):
    """{chi_square, freedom, p} of a constant for each experiment within the stated spread.

    p: share of data of the constants that have such a chi-square. Few replicates do not know their
    spread, so the law of chi-square itself would call up to a fifth of such data a misfit."""
    rng = np.random.default_rng([seed, 21])
    kinds, chi, null = _kinds(measurements), 0.0, np.zeros(replicates)
    for kind in kinds:
        own = [m for m in measurements if m.experiment == kind]
        readings, stated = readings_of(own, kind, {}), data_of(own).error[0]
        chi += float(_about_constant(readings.log[None], readings.error[None])[0])
        drawn = readings.error * rng.standard_normal((replicates, len(own)))
        error = redrawn_error(own, stated, replicates, rng) * readings.error / stated
        null += _about_constant(drawn, error)
    freedom = max(len(measurements) - len(kinds), 1)
    return {"chi_square": chi, "freedom": freedom, "p": share_above(null, chi)}


def _about_constant(log, error):
    """Chi-square (b,) of readings (b, n) with errors (b, n) about their best constant."""
    weight = error**-2.0
    level = (weight * log).sum(1) / weight.sum(1)
    return (weight * (log - level[:, None]) ** 2).sum(1)


def half_step(measurements, rig):
    """Rows of `diagnosis.time_step.row_of`: the integrated contacts at half their time step."""
    out = []
    for i in time_step.middles(measurements):
        m = measurements[i]
        log, _ = _level([m], m.experiment, None)
        name, low, high = COEFFICIENT[m.experiment]
        spec = rig.spec(m.condition, rig.settings.seed)
        value = float(np.exp(log / (IN_AIR if m.experiment == "drop" else 1.0)))
        spec = with_coefficient(spec, name, np.clip(value, low, high))
        full, half = (integrated(spec, m, finer) for finer in (1.0, 2.0))
        error = m.sd / np.sqrt(m.n)
        out.append(time_step.row_of(m, full, half, 0.0, float(error)))
    return out


def integrated(spec, measurement, finer=1.0):
    """The reading of one condition by the engine's contact, its time step divided by `finer`."""
    if measurement.experiment == "drop":
        return float(rebounds(spec, [measurement.levers["drop_height_mm"]], finer)[0])
    rate = parse_spec(spec).geometry.tilt_rate_deg_s
    return float(sliding_angles(spec, [rate], finer)[0])


def with_law(measurements, found):
    """Values (n,) that the law found predicts, or None without one; those of the constant where it
    says nothing."""
    if found.law is None:
        return None
    levels = {kind: _level(measurements, kind, found) for kind in _kinds(measurements)}
    value = np.array([r["predicted"] for r in _rows(measurements, levels)])
    rows, predicted = predictions(found.trials[found.law["experiment"]])
    value[rows] = predicted
    return value


def _kinds(measurements):
    return list(dict.fromkeys(m.experiment for m in measurements))


def _level(measurements, kind, found):
    """(logarithm of the best constant, its standard error) of an experiment, outliers left out."""
    tried = found.trials.get(kind) if found else None
    readings = tried.readings if tried else readings_of(measurements, kind, {})
    noise = np.diag(readings.error**2)
    if tried:
        noise = tried.nuisance.covariance[tried.base_fit.nuisance[0]]
    weight = np.linalg.inv(noise).sum(0)
    precision = weight.sum() + LEVEL_SD**-2
    return float((weight * readings.log).sum() / weight.sum()), float(precision**-0.5)


def _rows(measurements, levels):
    """Residuals of the constant, in the form of `diagnosis.residuals.residual_rows` but for their
    tail probability."""
    place = {id(m): i for i, m in enumerate(measurements)}
    rows = [None] * len(measurements)
    for kind, (log, _) in levels.items():
        own = [m for m in measurements if m.experiment == kind]
        readings = readings_of(own, kind, {})
        predicted = from_log(kind, np.full(len(own), log), readings.levers)
        for m, value, error, seen in zip(own, predicted, readings.error, readings.log, strict=True):
            off = float((seen - log) / error)
            rows[place[id(m)]] = {
                "experiment": kind,
                "levers": m.levers,
                "measured": m.value,
                "predicted": float(value),
                "sd": float(error * value),
                "standardised": off,
            }
    return rows


def _calibration(settings, factors, levels):
    """The base model's coefficients; one beyond the range of the factors' table is said and kept as
    measured."""
    known, out = {f.key: f for f in factors}, {}
    for kind, (log, error) in levels.items():
        power = IN_AIR if kind == "drop" else 1.0
        factor = known[settings.experiments[kind].parameters[0]]
        ends = [float(np.exp((log + z * error) / power)) for z in (-NORMAL_95, NORMAL_95)]
        value = float(np.exp(log / power))
        left = error / LEVEL_SD
        out[factor.name] = {
            "value": value,
            "sd": value * error / power,
            "low": ends[0],
            "high": min(ends[1], 1.0) if kind == "drop" else ends[1],
            "prior_sd_left": left,
            "identified": left < 0.5,
            "at_bound": not factor.low <= value <= factor.high,
            "words": parameter_words(factor.key),
        }
    return out
