"""Input that was changed at random leads to success or to one sentence, never to a traceback."""

import pytest
from fuzz import READERS, faults


# numpy leaves a damaged archive open until it is collected
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", READERS)
def test_changed_input_is_read_or_refused_in_a_sentence(name, tmp_path):
    found = faults(name, range(60), tmp_path)
    assert not found, "\n".join(f"seed {seed}: {text}" for seed, _, text in found[:3])
