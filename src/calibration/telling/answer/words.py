"""The answer in words, all of it made from answer.json; its sentences stand in `words.j2`."""

import re
from collections.abc import Mapping
from typing import Any

from calibration.engines.templates import macros
from calibration.figures import PLACES, label, response_of
from calibration.statistics.equivalence import judged, verdict_of
from calibration.statistics.numbers import difference_of, fixed, signed
from calibration.telling.answer.schema import Answer, Beside, Parameter, Test
from dem.units import behind, without_unit

MARKS = {"met": "✓", "missed": "✗", "not judged": "?", "not simulated": "–", "prediction": "→"}
OF = {
    "all tests": "by all tests",
    "one test": "",
    "one test, others held": "only if the others are right",
}
"""What an interval is of -> what is said of it."""


def name_of(key: str) -> str:
    """A key of the run spec in words: `materials.particle.density_kg_m3` is "density, grain"."""
    place, _, last = key.rpartition(".")
    return f"{label(without_unit(last))}, {PLACES.get(place, label(place))}"


def setting(levers: Mapping[str, float]) -> str:
    """Levers in words: "normal stress 2 kPa"."""
    return ", ".join(f"{response_of(k).name} {response_of(k).value(v)}" for k, v in levers.items())


def title(test: Test) -> str:
    """A row of the tests by name: "drop, rebound height at drop height 150 mm"."""
    at = f" at {setting(test.setting)}" if test.setting else ""
    return f"{label(test.test)}, {response_of(test.metric).name}{at}"


def number(parameter: Parameter) -> str:
    """A parameter's value without its unit; one that the data do not bound has two digits."""
    if isinstance(parameter.value, str):
        return label(parameter.value)
    digits = 2 if parameter.bounded is False else 4 if parameter.value % 1 else 6
    return f"{parameter.value:.{digits}g}"


def value(parameter: Parameter) -> str:
    """A parameter's value with its unit."""
    return f"{number(parameter)} {parameter.unit}".strip()


def known(parameter: Parameter) -> str:
    """How a parameter is known, in words."""
    if parameter.interval_95 is None:
        return parameter.source
    low, high = parameter.interval_95
    if parameter.bounded is False:
        return f"not bounded by what was measured: {low:.2g} to {high:.2g}"
    of = OF[parameter.interval_of] if parameter.interval_of else ""
    return f"95 %{' ' if of else ''}{of}: {low:.3g} to {high:.3g}"


def beside(found: Beside) -> dict[str, str]:
    """A row of what all tests together give, in words."""
    low, high = (f"{end:.3g}" for end in found.all_tests_95)
    return {
        "parameter": label(found.parameter),
        "handed out": f"{found.handed_out:.3g}",
        "all tests, 95 %": f"{low} to {high}",
        "": "inside" if found.inside else "outside",
    }


def compared(test: Test) -> dict[str, str]:
    """A row of the table of tests in words."""
    response = response_of(test.metric)
    said, unit = response.value, response.unit
    give = f" ± {test.error:.2g}{unit}" if test.error else ""
    own = f" ± {test.predicted_sd:.2g}{unit}" if test.predicted_sd else ""
    if test.interval_95:
        own = f" ({said(test.interval_95[0])} to {said(test.interval_95[1])})"
    return {
        "": MARKS[test.state],
        "test": title(test),
        "measured": "" if test.measured is None else f"{said(test.measured)}{give}",
        "predicted": "" if test.predicted is None else f"{said(test.predicted)}{own}",
        "pull": "" if test.pull is None else fixed(test.pull, 1, "+").replace("-", "−"),
        "verdict": f"{test.state}: {test.note}" if test.note else test.state,
    }


def head(answer: Answer) -> list[str]:
    """Lines in ASCII for the head of a file that another code reads: every measured row, and what
    is wrong."""
    measured = [t for t in answer.tests if t.measured is not None]
    rows = [compared(t) for t in measured]
    said = [
        f"{row['test']}: measured {row['measured']}, predicted {row['predicted'] or 'nothing'}, "
        f"{row['verdict']}"
        for row in rows
    ]
    said.append(f"What is wrong: {answer.wrong.sentence}")
    return [text.translate(ASCII).encode("ascii", "replace").decode() for text in said]


ASCII = str.maketrans({"±": "+-", "−": "-", "°": " deg", "µ": "u", "²": "2", "³": "3", "’": "'"})


def given_nowhere(summary: Mapping[str, Any]) -> bool:
    """Return whether no point of the region is predicted to give the target."""
    return not summary.get("attainable", True)


def between(name: str) -> str:
    """A factor's name in a sentence: what two grains do is `between grains`."""
    return re.sub(r" of (\w+) on \1$", " between grains", label(name))


FILTERS = {
    "behind": behind, "between": between, "compared": compared, "difference_of": difference_of,
    "given_nowhere": given_nowhere, "judged": judged, "known": known, "label": label,
    "response_of": response_of, "signed": signed, "title_of": title,
    "value": lambda x, response: response.value(x), "value_of": value, "verdict": verdict_of,
}  # fmt: skip


def said(macro: str, *given: Any, template: str = "telling/answer/words", **told: Any) -> list[str]:
    """The lines that a macro gives, of `words.j2` or of another template of the package."""
    words = macros("calibration", template, tuple(FILTERS.items()))
    return [x for x in getattr(words, macro)(*given, **told).splitlines() if x]
