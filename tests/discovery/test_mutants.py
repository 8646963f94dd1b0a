"""Each rule of the diagnosis is needed: without it a default test fails."""

import mutants
import pytest


@pytest.mark.slow
@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=[m.name for m in mutants.MUTANTS])
def test_a_default_test_kills(mutant):
    assert mutants.killer(mutant)
