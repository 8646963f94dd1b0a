"""Each rule of the diagnosis is needed: without it a default test fails."""

import mutants
import pytest

# every seventh; the others are too long beside them
CASES = [
    pytest.param(mutant, id=mutant.name, marks=pytest.mark.long if n % 7 else ())
    for n, mutant in enumerate(mutants.MUTANTS)
]


@pytest.mark.slow
@pytest.mark.parametrize("mutant", CASES)
def test_a_default_test_kills(mutant):
    assert mutants.killer(mutant)
