"""The stages of a study: one module for each, or for those that belong together.

A module holds all of a stage but its rules: the function that plans its runs, the one that analyses
them, its figures, and at its end the declaration STAGES. The functions are called with `(study,
source, output)` by the rules in `workflow/rules`. They hold no statistics of their own; those are
in `calibration.statistics`. What a stage says for the report stands in `sentences.j2`.
"""

from collections.abc import Callable
from typing import Any

from calibration.telling.answer.words import said


def worded(name: str, **told: Any) -> Callable[..., list[str]]:
    """A function that gives sentences, of a summary and the `Response` as a rule: the lines of the
    macro `name` of `sentences.j2`, to which `told` is told besides."""

    def sentences(*given):
        return said(name, *given, template="stages/sentences", **told)

    return sentences
