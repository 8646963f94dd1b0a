"""Emulators of the atlas, corrected by a study's own runs: few of these are enough, as what they
differ by from the atlas bends less than the response (Kennedy and O'Hagan 2000, Biometrika
87:1)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from calibration.atlas.emulators import AtlasEmulators
from calibration.chain.joint.analysis import Emulators
from calibration.inference.gaussian_process import GaussianProcess
from calibration.study.config import Config


class Corrected:
    """A response of the atlas and the process of what a study's runs differ by from it; as
    `GaussianProcess`. The atlas' own error is in the difference, and counts there."""

    def __init__(self, atlas: Any, difference: GaussianProcess) -> None:
        self.atlas, self.difference = atlas, difference

    def mean(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each, at u (k, d)."""
        mean, variance = self.difference.mean(u)
        return self.atlas.mean(u)[0] + mean, variance

    def sd_of_run(self, u: np.ndarray) -> np.ndarray:
        """Standard deviation (k,) of a single run about the mean."""
        return self.difference.sd_of_run(u)


class CorrectedEmulators(Emulators):
    """`Emulators` of a design's runs that begin from the atlas in the tests that it has."""

    def __init__(self, config: Config, factors: Sequence[Any], design: pd.DataFrame) -> None:
        super().__init__(factors, design)
        self.atlas = AtlasEmulators(config, factors)

    def trained(self, rig: str, metric: str, u: np.ndarray, values: np.ndarray) -> Any:
        """The emulator of values (n,) at u (n, d)."""
        if not self.atlas.has(rig, metric):
            return super().trained(rig, metric, u, values)
        own = self.atlas.of(rig, metric)
        return Corrected(own, GaussianProcess().fit(u, values - own.mean(u)[0]))
