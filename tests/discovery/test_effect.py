"""The size of an effect: what the base model cannot take up, and the strength that makes it as
large as stated."""

import numpy as np
import pytest
from effect import MODERATE, sizes, strength_at

from benchmarks.rates.hidden import standard_error
from diagnosis.fit import Data, fit


def test_a_moderate_effect_has_the_size_that_it_is_defined_by(laboratory, drops):
    for name in ("apex_sampling", "plastic_restitution"):
        natural, size = strength_at(laboratory.emulated, drops, name, MODERATE)
        strength = laboratory.emulated.catalogue[name].strength
        assert strength.low < natural < strength.high
        assert MODERATE <= size < 1.1 * MODERATE
        again, _, inside = sizes(
            laboratory.emulated, drops, name, np.array([strength.coded(natural)])
        )
        assert inside.all()
        assert again == pytest.approx(size, rel=0.01)


def test_what_the_base_parameters_take_up_has_no_size(laboratory, drops):
    """A camera without an interval between its frames changes nothing, nor does one restitution for
    another."""
    none, *_ = sizes(laboratory.emulated, drops, "apex_sampling", np.array([0.0]))
    assert none == pytest.approx(0.0, abs=0.1)
    model = laboratory.emulated.model(drops)
    value, _ = model.predict(np.full((1, len(model.names)), 0.7))
    error = [standard_error(e, v) for (e, _), v in zip(drops, value.T, strict=True)]
    assert fit(model, Data(value, np.column_stack(error))).chi_square[0] < 0.1


def test_what_fits_worst_is_taken_where_nothing_is_so_large(laboratory, drops):
    natural, size = strength_at(laboratory.emulated, drops, "apex_sampling", 1e6)
    assert natural == pytest.approx(laboratory.emulated.catalogue["apex_sampling"].strength.high)
    assert MODERATE < size < 1e6
