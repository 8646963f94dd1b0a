"""The one further measurement that would tell the candidate models apart best, by expected
information."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import levers_of
from diagnosis.fit import Fit
from diagnosis.model import Emulated
from diagnosis.settings import Settings, lever_values

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
        points = [(lo, float(np.sqrt(lo * hi)), hi) for lo, hi in ranges.values()]  # type: ignore[union-attr]  # `derived` fills it in
        framed = any("output_interval_s" in m.levers for m in measurements)
        for values in itertools.product(*points):
            levers = {n: float(f"{v:.3g}") for n, v in zip(ranges, values, strict=True)}  # type: ignore[arg-type]  # `derived` fills it in
            levers = {n: min(max(v, ranges[n][0]), ranges[n][1]) for n, v in levers.items()}  # type: ignore[index]  # `derived` fills it in
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
    noise = _noise(emulated.settings, measurements, conditions)
    means, sds = [], []
    for names, fitted in fits.items():
        mean, sd = _predictive(emulated.model(conditions, names), fitted, conditions, noise, seed)
        means.append(mean)
        sds.append(sd)
    means, sds = np.array(means), np.array(sds)
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


def _noise(settings, measurements, conditions):
    """Standard errors (k,) at the candidates: the median of the experiment's, relative where values
    span decades."""
    share = {
        kind: float(
            np.median([m.sd / m.value / np.sqrt(m.n) for m in measurements if m.experiment == kind])
        )
        for kind in {m.experiment for m in measurements}
    }
    return np.array([share[kind] for kind, _ in conditions])


def _predictive(model, fitted, conditions, noise, seed):
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
