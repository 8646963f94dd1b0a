"""The one further measurement that would tell what is in question apart best, by the mutual
information between candidate and reading.

Each rival is put in the model of the table. A reading that has no weight is put at a setting that
has not been measured, of single contacts within twice the plan's range, of simulated tests at the
ends and the middle of what the emulators cover, and the model says what it expects there.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from calibration.intake.quantities import LEVERS
from diagnosis.laws.readings import from_log, with_setting
from diagnosis.page.words import place, told
from diagnosis.table_model.block import ERROR, LAW, Block, Term
from diagnosis.table_model.selection import blocks_of, held_in_turn

SAMPLES = 2000


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
    settings = [(readings.experiment, *own) for own in _settings(readings)]
    means, sds = np.empty((2, len(keys), len(settings)))
    for j, (_, levers, covariates) in enumerate(settings):
        [wider] = blocks_of([with_setting(readings, levers, covariates)], None).values()
        for i, rival in enumerate(keys):
            means[i, j], sds[i, j] = _expected(wider, block, key, rival)
    error = np.full(len(settings), np.median(readings.error))
    words = [words_of(terms[k]) for k in keys]
    return best_of(settings, words, means, sds, error) | {"text": _text(block, keys, again)}


def best_of(
    settings: Sequence[tuple[str, dict, dict]],
    words: Sequence[str],
    means: np.ndarray,
    sds: np.ndarray,
    error: np.ndarray,
    weight: np.ndarray | None = None,
) -> dict[str, Any]:
    """{experiment, levers, information_bits, predictions} of the best of k settings [(experiment,
    levers, covariates)], for rivals with means and standard deviations (r, k) of the logarithm
    there; error: (k,) of a reading; weight: (r,) probabilities of the rivals, alike unless
    given."""
    sds = np.hypot(sds, error)
    weight = np.ones(len(words)) if weight is None else weight
    bits = information(means, sds, weight / weight.sum(), np.random.default_rng(0))
    best = int(np.argmax(bits))
    kind, levers, covariates = settings[best]
    predictions = {}
    for name, mean, sd in zip(words, means[:, best], sds[:, best], strict=True):
        value, low, high = from_log(kind, mean + sd * np.array([0.0, -1.0, 1.0]), levers).tolist()
        predictions[name] = {"value": value, "sd": 0.5 * (high - low)}
    out = {"experiment": kind, "levers": levers | covariates}
    return out | {"information_bits": float(bits[best]), "predictions": predictions}


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
