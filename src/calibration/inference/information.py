"""What a measurement that nobody has made yet is expected to tell of the parameters.

Arrays in, arrays out; the draws are those of a posterior (`posterior_sampling`).
"""

import numpy as np
import numpy.typing as npt
from scipy import stats

from calibration.errors import CalibrationError

SIGMAS, ENTROPY_GRID = 6.0, 2001
IMAGINED = 200  # outcomes of a measurement that are imagined


def expected_information(predicted: npt.ArrayLike, error_sd: npt.ArrayLike) -> float:
    """Information [nat] that a measurement is expected to give of the parameters.

    predicted: (n,) its expected values at draws of the posterior; error_sd: (n,) or one standard
    deviation of its error there. It is the entropy of what could be measured less that of the error
    (Lindley 1956, Annals of Mathematical Statistics 27:986); both are computed, the first of the
    mixture on a grid. Raises CalibrationError for an error of 0.
    """
    predicted = np.asarray(predicted, float)
    sd = np.broadcast_to(np.asarray(error_sd, float), predicted.shape)
    if not (sd > 0.0).all():
        raise CalibrationError("an expected measurement needs an error above 0")
    low, high = (predicted - SIGMAS * sd).min(), (predicted + SIGMAS * sd).max()
    points = max(ENTROPY_GRID, int(4 * (high - low) / sd.min()) + 1)
    grid = np.linspace(low, high, points)
    density = np.mean([stats.norm.pdf(grid, m, s) for m, s in zip(predicted, sd, strict=True)], 0)
    logs = np.log(np.where(density > 0.0, density, 1.0))
    entropy = -np.trapezoid(density * logs, grid)
    return float(max(entropy - np.mean(0.5 * np.log(2.0 * np.pi * np.e * sd**2)), 0.0))


def expected_spread(
    predicted: npt.ArrayLike, error_sd: npt.ArrayLike, draws: npt.ArrayLike, seed: int = 1
) -> np.ndarray:
    """Standard deviation (d,) that each parameter is expected to have after a measurement.

    predicted, error_sd: as of `expected_information`; draws: (n, d) of the posterior. Outcomes are
    imagined at draws taken in turn, and all draws weighed by what each outcome says of them; the
    variances are averaged (Lindley 1956).
    """
    predicted, draws = np.asarray(predicted, float), np.asarray(draws, float)
    sd = np.broadcast_to(np.asarray(error_sd, float), predicted.shape)
    rng = np.random.default_rng(seed)
    pick = np.linspace(0, len(predicted) - 1, min(IMAGINED, len(predicted))).astype(int)
    outcomes = rng.normal(predicted[pick], sd[pick])
    variances = []
    for y in outcomes:
        log = -0.5 * ((y - predicted) / sd) ** 2 - np.log(sd)
        weight = np.exp(log - log.max())
        mean = np.average(draws, axis=0, weights=weight)
        variances.append(np.average((draws - mean) ** 2, axis=0, weights=weight))
    return np.sqrt(np.mean(variances, axis=0))
