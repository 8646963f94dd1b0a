"""Every file of nonsense is refused in a sentence that names the file and the place; none is taken
in silence."""

import pytest
from nonsense import CORPUS, KINDS, TEXTS, refusal, sound

from facts import holds

LONGEST = 1500
"""Characters of a refusal."""


# numpy leaves a damaged archive open until it is collected
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("kind", KINDS)
def test_nonsense_is_refused_by_name(kind, tmp_path):
    wrong = []
    for n, case in enumerate(case for case in CORPUS if case.kind == kind):
        folder = tmp_path / str(n)
        folder.mkdir()
        said = refusal(case, folder)
        missing = [name for name in case.named if not holds(said or "", name)]
        if said is None or missing or len(said) > LONGEST:
            wrong.append(f"{case.fault}: {said}; not named: {missing}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("kind", [k for k in TEXTS if k != "STL"])  # that one is open
def test_the_file_that_is_changed_is_sound(kind, tmp_path):
    sound(kind, tmp_path)
