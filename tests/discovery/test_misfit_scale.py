"""Each experiment has a misfit of its own: one that scatters more than it states widens nothing
that another says."""

import numpy as np
import pytest
from linear_model import Linear

from calibration.intake.measurements import Measurement
from diagnosis.fit import data_of, fit

SD, REPLICATES, N = 50.0, 10_000, 40  # so many that the spread is known
ERROR = SD / np.sqrt(REPLICATES)


def fitted(times):
    """Fit of a level for the heaps and one for the tilts, whose readings scatter by `times` the
    error that they state; every other reading is of a tilt."""
    rng = np.random.default_rng(4)
    tilt = np.arange(N) % 2 == 1
    off = rng.standard_normal(N)
    for own in (tilt, ~tilt):  # the sample has just the spread that is asked for
        off[own] = (off[own] - off[own].mean()) / off[own].std(ddof=1)
    values = 30.0 + ERROR * np.where(tilt, times, 1.0) * off
    model = Linear(np.column_stack([~tilt, tilt]).astype(float))
    model.prior_mean[:], model.prior_sd[:] = 30.0, 1e3
    own = [
        Measurement(kind, v, SD, REPLICATES, {"particle_diameter_mm": 2.0 + 0.01 * i})
        for i, (kind, v) in enumerate(zip(np.where(tilt, "tilt", "heap"), values, strict=True))
    ]
    return fit(model, data_of(own)), tilt


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_the_scale_is_that_of_the_experiment(times):
    found, tilt = fitted(times)
    assert found.scale[0, ~tilt] == pytest.approx(1.0, abs=1e-3)
    assert found.scale[0, tilt] == pytest.approx(times, rel=1e-3)


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_an_interval_is_widened_by_the_misfit_of_its_own_experiment(times):
    """The mean of n readings whose errors are sigma is known to sigma / sqrt(n)."""
    found, _ = fitted(times)
    sd = np.sqrt(np.diag(found.cov[0]))
    known = ERROR / np.sqrt(0.5 * N)
    assert sd == pytest.approx([known, times * known], rel=1e-3)
