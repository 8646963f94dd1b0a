"""Which mechanism explains a misfit: held-out scores of the whole catalogue against what base-model data give.

The score of a model is the sum over settings of the log predictive density of that setting when it is left out. A
model's spread is scaled up where it does not fit, so twice the noise gains nothing. The null distribution is that of
the best gain over all mechanisms on data simulated from the fitted base model (parametric bootstrap), which holds the
chance of a false alarm over the whole catalogue. Half of it is given to the lack-of-fit test.
"""

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from calibration.discrepancy.fit import Data, data_of, fit, moderated_sd

CLOSE = 2.0  # nats; causes this close to the best are not told apart (odds of about 7 to 1)
BASE = "base"


@dataclass
class Identification:
    """What the scores say; `fits` holds the fit of each candidate, by its names joined with ' + '."""

    verdict: str
    causes: list
    ranking: list
    lack_of_fit_p: float
    family_p: float
    threshold: float
    fits: dict = field(repr=False)
    models: dict = field(repr=False)
    reason: str = ""


def key_of(names):
    """Name of a set of mechanisms."""
    return " + ".join(names) if names else BASE


def identify(emulated, measurements, alpha=0.05, replicates=300, seed=0):
    """`Identification` of the measurements."""
    conditions = [(m.experiment, m.levers) for m in measurements]
    data = data_of(measurements)
    rng = np.random.default_rng(seed)
    models = {BASE: emulated.model(conditions)}
    singles = emulated.applicable(conditions)
    models |= {name: emulated.model(conditions, [name]) for name in singles}
    fits = {name: fit(model, data) for name, model in models.items()}
    null = _null(models, fits[BASE], BASE, singles, measurements, data, replicates, rng)
    gains = {name: float((fits[name].score - fits[BASE].score)[0]) for name in singles}
    best = max(gains, key=gains.get)
    chi = float(fits[BASE].chi_square[0])
    lack_p = _share_above(null["chi_square"], chi)
    family_p = _share_above(null["best"], gains[best])
    threshold = float(np.quantile(null["best"], 1.0 - 0.5 * alpha))
    ranking = [
        {
            "mechanism": name,
            "score": float(fits[name].score[0]),
            "gain": gains[name],
            "null_threshold": float(np.quantile(null[name], 1.0 - 0.5 * alpha)),
            "p": _share_above(null[name], gains[name]),
            "p_family": _share_above(null["best"], gains[name]),
            "strength": strength_of(models[name], fits[name], 0),
        }
        for name in sorted(gains, key=gains.get, reverse=True)
    ]
    out = Identification("", [], ranking, lack_p, family_p, threshold, fits, models)
    if family_p >= 0.5 * alpha:
        out.verdict = "adequate" if lack_p >= 0.5 * alpha else "unexplained"
        out.reason = (
            "the base model fits within the stated spread"
            if out.verdict == "adequate"
            else "the base model misses the data and no mechanism predicts left-out settings better"
        )
        return out
    if _one_setting_does_it(models, fits, best, measurements):
        out.verdict, out.reason = "unexplained", "one setting alone is at odds with the base model"
        return out
    _settle(out, emulated, conditions, measurements, data, singles, best, alpha, replicates, rng)
    return out


def _share_above(sample, value):
    return float((1 + np.sum(sample >= value)) / (1 + len(sample)))


def simulate_data(fitted, measurements, data, replicates, rng):
    """`Data` of `replicates` sets from a fit: noise as measured, scaled by the fit's misfit; spreads drawn anew."""
    truth = fitted.predicted[0]
    scale = float(fitted.scale[0])
    noise = scale * data.error[0]
    value = truth + noise * rng.standard_normal((replicates, len(truth)))
    n = np.array([m.n for m in measurements], float)
    freedom = np.maximum(n - 1.0, 1.0) + 8.0
    drawn = data.error[0] * np.sqrt(rng.chisquare(freedom, value.shape) / freedom)
    return Data(value, np.where(n > 1, drawn, data.error[0]))


def _null(models, fitted, start, names, measurements, data, replicates, rng):
    """Null gains (replicates,) of each name over `start`, of the best of them, and the chi-square of `start`."""
    simulated = simulate_data(fitted, measurements, data, replicates, rng)
    reference = fit(models[start], simulated)
    gains = {name: fit(models[name], simulated).score - reference.score for name in names}
    honest = Data(
        fitted.predicted[0] + (simulated.value - fitted.predicted[0]) / float(fitted.scale[0]),
        simulated.error,
    )
    chi = reference.chi_square if fitted.scale[0] == 1.0 else fit(models[start], honest).chi_square
    return gains | {"best": np.max(list(gains.values()), axis=0), "chi_square": chi}


def _one_setting_does_it(models, fits, best, measurements):
    """Whether dropping one setting mends the base model as well as the best mechanism does with all of them.

    Both spend one parameter: an outlying setting's own mean, or the mechanism's strength. Compared by chi-square.
    """
    base = fits[BASE]
    # chi-square falls by e^2 / (1 - h) when a setting is dropped
    relief = float((base.residual**2 / (1.0 - base.leverage))[0].max())
    mended = float((base.chi_square - fits[best].chi_square)[0])
    return relief > mended - 4.0


def _settle(out, emulated, conditions, measurements, data, singles, best, alpha, replicates, rng):
    """Choose among the causes: one, several that are too close, a pair, or none that fits."""
    top = out.ranking[0]["score"]
    close = [r["mechanism"] for r in out.ranking if top - r["score"] < CLOSE]
    fitted = out.fits[best]
    null = simulate_data(fitted, measurements, data, replicates, rng)
    honest = Data(
        fitted.predicted[0] + (null.value - fitted.predicted[0]) / float(fitted.scale[0]),
        null.error,
    )
    chi_null = fit(out.models[best], honest).chi_square
    fits_well = _share_above(chi_null, float(fitted.chi_square[0])) >= 0.01
    if not fits_well:
        pair = _best_pair(out, emulated, conditions, measurements, data, singles, replicates, rng)
        if pair:
            out.verdict, out.causes = pair
            out.reason = "no single mechanism fits; these two together do"
            return
        out.verdict = "unexplained"
        out.reason = f"{best} helps most, but the data still contradict it"
        return
    out.causes = close
    out.verdict = "identified" if len(close) == 1 else "ambiguous"
    out.reason = (
        "predicts left-out settings better than every other mechanism"
        if len(close) == 1
        else "these predict left-out settings about equally well"
    )


def _best_pair(out, emulated, conditions, measurements, data, singles, replicates, rng):
    """(verdict, causes) where two mechanisms together fit and gain significantly over the best one; else None."""
    pairs = [p for p in combinations(singles, 2)]
    scores = {}
    for pair in pairs:
        name = key_of(pair)
        out.models[name] = emulated.model(conditions, pair)
        out.fits[name] = fit(out.models[name], data)
        scores[pair] = float(out.fits[name].score[0])
    ordered = sorted(scores, key=scores.get, reverse=True)
    if not ordered:
        return None
    first = ordered[0]
    fitted = out.fits[key_of(first)]
    null = simulate_data(fitted, measurements, data, replicates, rng)
    chi_null = fit(out.models[key_of(first)], null).chi_square
    if _share_above(chi_null, float(fitted.chi_square[0])) < 0.01:
        return None
    if scores[first] - out.ranking[0]["score"] < out.threshold:
        return None
    close = [p for p in ordered if scores[first] - scores[p] < CLOSE]
    out.ranking = [
        {
            "mechanism": key_of(p),
            "score": scores[p],
            "gain": scores[p] - float(out.fits[BASE].score[0]),
        }
        for p in ordered[:3]
    ] + out.ranking
    if len(close) == 1:
        return "identified", list(first)
    return "ambiguous", sorted({m for p in close for m in p})


def strength_of(model, fitted, row):
    """{name, unit, value, low, high} of each mechanism's strength: mode and 95 % interval, cut at its range."""
    out = {}
    for k, m in enumerate(model.mechanisms, len(model.factors)):
        u, sd = fitted.theta[row, k], np.sqrt(fitted.cov[row, k, k])
        low, high = np.clip([u - 1.96 * sd, u + 1.96 * sd], 0.0, 1.0)
        out[m.name] = {
            "name": m.strength.name,
            "unit": m.strength.unit,
            "value": float(m.strength.natural(u)),
            "low": float(m.strength.natural(low)),
            "high": float(m.strength.natural(high)),
        }
    return out


__all__ = ["Identification", "identify", "key_of", "moderated_sd", "simulate_data", "strength_of"]
