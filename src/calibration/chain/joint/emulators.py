"""What runs say: an emulator of every metric of every rig, and with what was measured the posterior
that they give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint.likelihood import Joint, Response
from calibration.inference.posterior_sampling import Formed, Prior
from calibration.runs.plans import read_values

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.config.joint import JointTarget, MeasuredMean


LEAST_TESTS = 1
"""Tests of the laboratory behind a mean whose number of readings nobody states."""


class Emulators:
    """Emulators of any metric of any rig over the free factors, trained by a design's runs.

    factors: the free ones (d); design: table of finished runs with the columns rig, run_id and one
    for each factor.
    """

    def __init__(self, factors: Sequence[Any], design: pd.DataFrame) -> None:
        self.factors, self.design = factors, design
        self._kept: dict[tuple[str, str], GaussianProcess] = {}

    def inputs(self, rig: str) -> tuple[pd.DataFrame, np.ndarray]:
        """(table of the rig's runs, their levels (n, d) in [0, 1])."""
        runs = self.design[self.design["rig"] == rig].reset_index(drop=True)
        levels = [0.5 + 0.5 * f.coded(runs[f.name].to_numpy(float)) for f in self.factors]
        return runs, np.column_stack(levels)

    def values(self, rig: str, metrics: Sequence[str]) -> np.ndarray:
        """(n, q) metrics of the rig's runs, nan where a run gave none."""
        runs, _ = self.inputs(rig)
        return np.column_stack([read_values(runs["run_id"], m) for m in metrics])

    def of(self, rig: str, metric: str) -> GaussianProcess:
        """The emulator of a metric. Raises CalibrationError naming rig and metric where too few
        runs gave a value, or all the same."""
        if (rig, metric) not in self._kept:
            _, u = self.inputs(rig)
            values = self.values(rig, [metric])[:, 0]
            has = np.isfinite(values)
            try:
                self._kept[rig, metric] = GaussianProcess().fit(u[has], values[has])
            except CalibrationError as error:
                raise CalibrationError(f"rig {rig}, {metric}: {error}") from None
        return self._kept[rig, metric]

    def known(self, rig: str, metrics: Sequence[str]) -> dict[str, GaussianProcess]:
        """{metric: emulator} of those metrics that the rig's runs tell."""
        found = {}
        for metric in metrics:
            try:
                found[metric] = self.of(rig, metric)
            except CalibrationError:
                continue  # it does not vary, or few runs give it
        return found

    def formed(self, rig: str, metrics: Sequence[str], tests: float) -> Formed | None:
        """`Formed` of `tests` of a rig that gave all metrics; None where no run lacks one."""
        _, u = self.inputs(rig)
        failed = ~np.isfinite(self.values(rig, metrics)).all(axis=1)
        return Formed(Chance(u, failed, np.ones(len(u))), tests) if failed.any() else None  # type: ignore[arg-type]  # infinite where a mean is stated


def joint_of(
    config: Config, emulators: Emulators, measured: Mapping[JointTarget, MeasuredMean]
) -> Joint:
    """The `Joint` of what was measured. Raises CalibrationError for a target that its runs do not
    tell."""
    responses, formed = [], {}
    for target, mean in measured.items():
        responses.append(_response(target, mean, emulators))
        few = not np.isfinite(mean.freedom)
        tests = LEAST_TESTS if few else mean.freedom + len(mean.metrics)
        for rig, metrics in mean.of_tests.items():
            own = emulators.formed(rig, metrics, tests)
            if own:
                formed[rig] = own
    prior = prior_of(config, emulators.factors)
    return Joint(tuple(responses), prior, tuple(formed.values()))


def _response(target: Any, measured: MeasuredMean, emulators: Emulators) -> Response:
    return Response(
        target.name,
        tuple(emulators.of(r, m) for r, m in zip(measured.tests, measured.metrics, strict=True)),
        measured.mean,
        measured.covariance,
        measured.freedom,
        np.full(len(measured.metrics), target.discrepancy),
    )


def prior_of(config: Config, factors: Sequence[Any]) -> Prior:
    """The `Prior` of the free factors (d): flat over their levels where `posterior.priors` names
    none."""
    mean, sd = np.full(len(factors), 0.5), np.full(len(factors), np.inf)
    for k, f in enumerate(factors):
        if f.name in config.posterior.priors:
            known = config.posterior.priors[f.name]
            mean[k] = 0.5 + 0.5 * f.coded(known.mean)
            sd[k] = 0.5 * known.sd / f.half_range
    return Prior(mean, sd)
