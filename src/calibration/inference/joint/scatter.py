"""The emulator of a response, with the error that its own runs show."""

import numpy as np
from numpy.typing import ArrayLike

from calibration.inference.posterior_sampling import ScatterEmulator


class Judged(ScatterEmulator):
    """A `ScatterEmulator` whose variance is widened where leaving runs out shows that the process
    is surer than it may be, as next to a step.

    Raises CalibrationError for too few runs, as that does."""

    def mean(self, u: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each, at u (k, d)."""
        mean, variance = super().mean(u)
        return mean, variance + self.emulator.unexpected(np.atleast_2d(u))
