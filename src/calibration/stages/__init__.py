"""The stages of a study: one module for each, or for those that belong together.

A module holds all of a stage but its rules: the function that plans its runs, the one that analyses
them, its figures, and at its end the declaration STAGES. The functions are called with `(study,
source, output)` by the rules in `workflow/rules`. They hold no statistics of their own; those are
in `calibration.statistics`. What a stage says for the report stands in `sentences.j2`.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from calibration.figures import label, response_of
from calibration.statistics.equivalence import judged
from calibration.statistics.numbers import difference_of, fixed, signed
from calibration.telling.answer.words import capital, given_nowhere, out_of_reach
from dem.units import behind

FILTERS = {
    "behind": behind, "capital": capital, "difference_of": difference_of, "fixed": fixed,
    "fmt": format, "given_nowhere": given_nowhere, "judged": judged, "label": label,
    "out_of_reach": out_of_reach, "response_of": response_of, "signed": signed,
    "value": lambda x, response: response.value(x),
}  # fmt: skip


@cache
def _words():
    from jinja2 import Environment, PackageLoader, StrictUndefined  # most commands need none

    environment = Environment(
        loader=PackageLoader(__name__, "."), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= FILTERS
    return environment.get_template("sentences.j2").module


def worded(name: str, **told: Any) -> Callable[..., list[str]]:
    """A function that gives sentences, of a summary and the `Response` as a rule: the lines of the
    macro `name` of `sentences.j2`, to which `told` is told besides."""

    def sentences(*given):
        return [line for line in getattr(_words(), name)(*given, **told).splitlines() if line]

    return sentences
