"""The one further measurement that would tell what is in question apart best, by the mutual
information between candidate and reading: among models of emulators, or among terms of the model of
a table.

Of a table each rival is put in the model. A reading that has no weight is put at a setting that has
not been measured, within twice the plan's range, and the model says what it expects there.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, levers_of
from diagnosis.fit import Fit
from diagnosis.laws.readings import from_log, with_setting
from diagnosis.model import Emulated
from diagnosis.page.words import place, told
from diagnosis.settings import Settings, lever_values
from diagnosis.table_model.block import ERROR, LAW, Block, Term
from diagnosis.table_model.selection import blocks_of, held_in_turn

SAMPLES = 2000
FRAME_INTERVALS_S = (0.005, 0.03)


def candidates(
    settings: Settings, measurements: Sequence[Measurement]
) -> list[tuple[str, dict[str, float]]]:
    """Conditions (experiment, levers): the ends and the middle of each lever, of every experiment
    in the settings."""
    out = []
    for kind in dict.fromkeys(m.experiment for m in measurements):
        ranges = settings.experiments[kind].levers
        points = [(lo, float(np.sqrt(lo * hi)), hi) for lo, hi in ranges.values()]  # type: ignore[union-attr]  # `setup` fills it in
        framed = any("output_interval_s" in m.levers for m in measurements)
        for values in itertools.product(*points):
            levers = {n: float(f"{v:.3g}") for n, v in zip(ranges, values, strict=True)}  # type: ignore[arg-type]  # `setup` fills it in
            levers = {n: min(max(v, ranges[n][0]), ranges[n][1]) for n, v in levers.items()}  # type: ignore[index]  # `setup` fills it in
            if framed and "output_interval_s" in levers_of(kind):
                out += [(kind, levers | {"output_interval_s": t}) for t in FRAME_INTERVALS_S]
            else:
                out.append((kind, levers))
    return out


def propose(
    emulated: Emulated,
    measurements: Sequence[Measurement],
    fits: Mapping[tuple[str, ...], Fit],
    weights: Mapping[tuple[str, ...], float],
    seed: int = 0,
) -> dict[str, Any] | None:
    """The condition with the largest mutual information between model and value, or None with fewer
    than two models.

    fits: {names of mechanisms (tuple): Fit of those measurements}; weights: {the same:
    probability}. Returns a mapping: experiment, levers, information_bits, predictions by model.
    """
    if len(fits) < 2:
        return None
    conditions = candidates(emulated.settings, measurements)
    noise = _noise(measurements, conditions)
    found = [_predictive(emulated.model(conditions, n), f, noise, seed) for n, f in fits.items()]
    means, sds = (np.array(part) for part in zip(*found, strict=True))
    weight = np.array([weights[n] for n in fits])
    bits = information(means, sds, weight / weight.sum(), np.random.default_rng(seed))
    k = int(np.argmax(bits))
    kind, levers = conditions[k]
    return {
        "experiment": kind,
        "levers": lever_values(emulated.settings, kind, levers) | levers,
        "information_bits": float(bits[k]),
        "predictions": {
            " + ".join(n) or "base": {"value": float(means[i, k]), "sd": float(sds[i, k])}
            for i, n in enumerate(fits)
        },
    }


def _noise(measurements, conditions):
    """Standard errors (k,) at the candidates, as shares: the median of the experiment's."""
    share = {}
    for kind in {m.experiment for m in measurements}:
        own = [m.sd / m.value / np.sqrt(m.n) for m in measurements if m.experiment == kind]
        share[kind] = float(np.median(own))
    return np.array([share[kind] for kind, _ in conditions])


def _predictive(model, fitted, noise, seed):
    """Mean and sd (k,) over the Laplace posterior, with the noise of a measurement.

    A parameter that the fit did not know, because its experiment was not measured, would be drawn
    from its prior."""
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(fitted.cov[0] + 1e-12 * np.eye(len(fitted.cov[0])))
    theta = fitted.theta[0] + rng.standard_normal((200, len(root))) @ root.T
    value, error = model.predict(np.clip(theta, model.low, model.high))
    mean = value.mean(0)
    return mean, np.sqrt(value.var(0) + (error**2).mean(0) + (noise * mean) ** 2)


def information(
    means: np.ndarray, sds: np.ndarray, weight: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Mutual information [bits] (k,) between the model and the value measured at each of k
    conditions."""
    out = np.zeros(means.shape[1])
    for i, w in enumerate(weight):
        y = means[i] + sds[i] * rng.standard_normal((SAMPLES, means.shape[1]))
        density = np.exp(-0.5 * ((y[None] - means[:, None]) / sds[:, None]) ** 2) / sds[:, None]
        mixture = np.einsum("m,msk->sk", weight, density)
        out += w * np.log2(density[i] / np.maximum(mixture, 1e-300)).mean(0)
    return out


BEYOND = 2.0  # of the plan's range, in either direction
DECIMALS = 3  # significant, of a lever that is proposed
MOST = 4  # rivals
MOST_SETTINGS = 30


def words_of(term: Term | None) -> str:
    """Return what a term says, in a few words; None: what scatters from setting to setting."""
    if term is None:
        return "error from setting to setting"
    if term.kind == LAW:
        return place(dict(zip(("slot", "state"), term.place, strict=True)))
    lever = LEVERS[term.of].words if term.of in LEVERS else term.of
    return {
        "levels": f"an error of each {lever} that was set",
        "one level": f"one {lever} that was set wrongly",
        "zero": f"a wrong zero of the {lever}",
        "exchanged": f"two exchanged levels of the {lever}",
    }.get(term.what, term.of or "a single row")


def propose_setting(
    block: Block, key: str, others: Sequence[str | None], again: str = ""
) -> dict[str, Any] | None:
    """{experiment, levers, information_bits, predictions, text} for a held term and the keys of
    others that are not told from it, None for errors from setting to setting; None where none of
    them says what it expects elsewhere. again: the level in question, the middle one unless
    given."""
    terms = {k: block.terms.get(k) for k in (key, *others)}
    keys = [k for k, t in terms.items() if t is None or (t.kind in (LAW, ERROR) and t.free)][:MOST]
    if len(keys) < 2:
        return None
    readings = block.readings
    settings = _settings(readings)
    error = float(np.median(readings.error))
    means, sds = np.empty((len(keys), len(settings))), np.empty((len(keys), len(settings)))
    for j, (levers, covariates) in enumerate(settings):
        [wider] = blocks_of([with_setting(readings, levers, covariates)], None).values()
        for i, rival in enumerate(keys):
            means[i, j], sds[i, j] = _expected(wider, block, key, rival)
    sds = np.hypot(sds, error)
    weight = np.full(len(keys), 1.0 / len(keys))
    bits = information(means, sds, weight, np.random.default_rng(0))
    best = int(np.argmax(bits))
    levers, covariates = settings[best]
    predictions = {}
    for i, rival in enumerate(keys):
        logs = means[i, best] + sds[i, best] * np.array([0.0, -1.0, 1.0])
        value, low, high = from_log(readings.experiment, logs, levers).tolist()
        predictions[words_of(terms[rival])] = {"value": value, "sd": 0.5 * (high - low)}
    return {
        "experiment": readings.experiment,
        "levers": levers | covariates,
        "information_bits": float(bits[best]),
        "predictions": predictions,
        "text": _text(block, keys, again),
    }


def _expected(wider, block, key, rival):
    """Mean and sd of the logarithm at the last setting, by a rival in the place of a term; None as
    the rival: by nothing in its place."""
    others = (k for k in block.held if k != key)
    mean, variance = held_in_turn(wider, (*others, rival)).expected()
    return mean[-1], np.sqrt(variance[-1])


def _settings(readings):
    """[({lever: value}, {covariate: value})] between levels, at the ends and beyond; levers that do
    not vary at their median."""
    along = {}
    for name, value in readings.levers.items():
        known = np.unique(value[np.isfinite(value)])
        if name not in readings.folds or known[0] <= 0.0:
            along[name] = [float(np.median(known))] if len(known) else []
            continue
        between = np.sqrt(known[1:] * known[:-1])
        wide = between[np.argsort(-np.diff(np.log(known)), kind="stable")][:2]
        ladder = (known[0] / BEYOND, known[0], *np.sort(wide), known[-1], known[-1] * BEYOND)
        inside = [v for v in ladder if LEVERS[name].least <= v <= LEVERS[name].most]
        along[name] = [float(f"{v:.{DECIMALS}g}") for v in inside]
    along = {n: v for n, v in along.items() if v}
    plain = [(dict(zip(along, at, strict=True)), {}) for at in itertools.product(*along.values())]
    plain = plain[:: max(len(plain) // MOST_SETTINGS, 1)]
    middle = {n: v[len(v) // 2] for n, v in along.items()}
    for name, value in readings.covariates.items():
        plain += [(middle, {name: float(v)}) for v in (value.min(), value.max())]
    return plain


def _text(block, keys, again):
    """Return what to measure, in words."""
    terms = [block.terms[k] for k in keys if k is not None]
    lever = next((t.of for t in terms if t.kind == ERROR and t.of in LEVERS), None)
    known = np.unique(block.readings.levers[lever]) if lever else np.zeros(0)
    known = known[np.isfinite(known) & (known > 0.0)]
    between = [f"{np.sqrt(a * b):.{DECIMALS}g}" for a, b in itertools.pairwise(known)][:2]
    again = again or (f"{known[len(known) // 2]:g}" if lever else "")
    facts = {"scatter": None in keys, "again": again, "between": between}
    return told("set_anew.j2", lever=LEVERS.get(lever), **facts)
