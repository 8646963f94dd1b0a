"""The further setting at which laws and forms that are tied would part most.

Each contender is fitted to the readings. The same fit gives what it expects at a setting that has
not been measured: a reading is put there that has no weight. The setting with the largest mutual
information between contender and reading is proposed, within twice the plan's range.
"""

import itertools

import numpy as np

from calibration.intake.quantities import LEVERS
from diagnosis.laws.choose import centre_of
from diagnosis.laws.forms import forms_of
from diagnosis.laws.mixed import evaluate, from_space, nuisance_of, posterior
from diagnosis.laws.readings import from_log, with_setting
from diagnosis.laws.slots import candidate_of
from diagnosis.next_measurement import information

BEYOND = 2.0  # of the plan's range, in either direction
DECIMALS = 3  # significant, of a lever that is proposed


def propose(tried, law, forms, rivals, seed=0):
    """{experiment, levers, information_bits, predictions} or None where fewer than two contend.

    law: the `FreeLaw` found; forms: names of its forms that are tied; rivals: names of other free
    laws that are."""
    contenders = [(law, form) for form in forms] if len(forms) > 1 else [(law, None)]
    contenders += [(tried.laws[name], None) for name in rivals if name in tried.laws]
    if len(contenders) < 2:
        return None
    readings, settings = tried.readings, _settings(tried.readings)
    error = float(np.median(readings.error))
    means, sds = (np.empty((len(contenders), len(settings))) for _ in range(2))
    for k, levers in enumerate(settings):
        wider = with_setting(readings, levers)
        centre = centre_of(readings, None)[0] + np.zeros(len(wider.log))
        nuisance = nuisance_of(wider)
        for i, (free, form) in enumerate(contenders):
            means[i, k], sds[i, k] = _expected(free, form, wider, centre, nuisance)
    sds = np.hypot(sds, error)
    weight = np.full(len(contenders), 1.0 / len(contenders))
    bits = information(means, sds, weight, np.random.default_rng(seed))
    best = int(np.argmax(bits))
    at = {n: np.array([v]) for n, v in settings[best].items()}
    predictions = {}
    for i, (free, form) in enumerate(contenders):
        ends = [from_log(readings.experiment, np.array([means[i, best] + s * sds[i, best]]), at)[0]
                for s in (0.0, -1.0, 1.0)]  # fmt: skip
        predictions[form or free.words] = {"value": ends[0], "sd": 0.5 * (ends[2] - ends[1])}
    return {
        "experiment": readings.experiment,
        "levers": settings[best],
        "information_bits": float(bits[best]),
        "predictions": predictions,
    }


def _settings(readings):
    """[{lever: value}] of every lever that varies at the ends, the middle and beyond; others at
    their median."""
    along = {}
    for name, value in readings.levers.items():
        known = value[np.isfinite(value)]
        if name not in readings.folds:
            along[name] = [float(np.median(known))] if len(known) else []
            continue
        low, high = known.min(), known.max()
        ladder = (low / BEYOND, low, np.sqrt(low * high), high, high * BEYOND)
        inside = [v for v in ladder if LEVERS[name].least <= v <= LEVERS[name].most]
        along[name] = [float(f"{v:.{DECIMALS}g}") for v in inside]
    along = {n: v for n, v in along.items() if v}
    return [dict(zip(along, at, strict=True)) for at in itertools.product(*along.values())]


def _expected(free, form, readings, centre, nuisance):
    """Mean and sd of the logarithm at the last setting, by a law or one of its forms."""
    if form:
        candidate = forms_of(free, readings, centre)[form]
    else:
        candidate = candidate_of(free, readings, centre)
    log = readings.log[None]
    fitted = evaluate(candidate, readings, nuisance, log, centre)
    mean, covariance = posterior(candidate, readings, nuisance, fitted, log, centre)
    step = 1e-4
    value, moved = (from_space(candidate.space, mean + s, centre)[-1] for s in (0.0, step))
    return value, abs(moved - value) / step * float(np.sqrt(max(covariance[-1, -1], 0.0)))
