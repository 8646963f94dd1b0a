"""Whether the model of a joint posterior can give what was measured at all.

The names follow those of `sbi.diagnostics`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from calibration.inference.joint.likelihood import Cloud, Joint


def imagined(joint: Joint, u: np.ndarray, rng: np.random.Generator) -> list[Sequence[Any]]:
    """Measured values at u (k, d) as the model gives them: k lists with one (q,) a response."""
    drawn = [r.drawn(*r.predicted(u), rng) for r in joint.responses]
    return list(zip(*drawn, strict=True))


def misspecification(joint: Joint, studies: int = 1000, seed: int = 1, size: int = 4000) -> float:
    """p of the measured values under the prior predictive: the share of values that the model gives
    anywhere in the region whose evidence is no larger than theirs.

    Small where no parameters of the region give what was measured, as `sbi`'s check by the log
    probability of the data does (Schmitt et al. 2023, arXiv:2112.08866, ask the same of summaries).
    """
    cloud, rng = Cloud.of(joint, size, seed), np.random.default_rng(seed)
    given = _log_evidence(cloud, [r.mean for r in joint.responses])
    values = imagined(joint, joint.prior.draw(studies, rng), rng)
    found = np.array([_log_evidence(cloud, v) for v in values])
    return float((1 + np.sum(found <= given)) / (studies + 1))


def _log_evidence(cloud, measured):
    log = cloud.log_likelihood(measured)
    return float(log.max() + np.log(np.mean(np.exp(log - log.max()))))
