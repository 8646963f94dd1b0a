"""The answer in sentences and in lines of a terminal, all of them made from answer.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calibration.figures import PLACES, label, response_of
from calibration.statistics.equivalence import UNDECIDED, judged, verdict_of
from calibration.statistics.numbers import difference_of, fixed
from dem.units import without_unit

if TYPE_CHECKING:
    from calibration.figures import Response
    from calibration.telling.answer.schema import Answer, Beside, Instead, Parameter, Test


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


def missed(test: Test) -> str:
    """A sentence on a row that is missed."""
    row = compared(test)
    return (
        f"{capital(row['test'])}: measured {row['measured']}, the parameters handed out give "
        f"{row['predicted']} (pull {row['pull']})."
    )


def instead(found: Instead, origin: str) -> str:
    """Sentences on a parameter of which another test of the study finds another level."""
    response, name = response_of(found.metric), label(found.parameter)
    said = (
        f"{capital(name)} is handed out as {found.handed_out:g} ({origin}); the study's own "
        f"{found.test} test gives {found.found:.3g}."
    )
    if found.change is None or found.change_95 is None:
        return said
    ends = dict(zip(("difference_low", "difference_high"), found.change_95, strict=True))
    change, low, high = difference_of({"difference": found.change} | ends)
    return (
        f"{said} With it the {response.name} changes by {change}{response.unit} (95 %: {low} to "
        f"{high}, {found.runs} runs)."
    )


def not_equivalent(found: Mapping[str, Any], response: Response, by: str) -> str:
    """Sentences on a validation (content of validation.json) that does not show the runs to be
    equivalent to the readings: what it shows, and what would help; by: as `Answer.by`."""
    apart, low, high = difference_of(found)
    said = (
        f"The {found['simulated_n']} validated runs differ by {apart}{response.unit} (95 % {low} "
        f"to {high}): {judged(found, response.unit)}."
    )
    if found["more_runs"]:
        return (
            f"{said} {found['more_runs']} more would decide, with this difference and scatter "
            "(validation.replicates)."
        )
    if verdict_of(found) == UNDECIDED:
        said += " No number of runs there would decide, because the readings scatter too much."
    if by == "joint":
        return said
    return (
        f"{said} More runs at the optimum before it is validated move it (optimise.candidate_runs)."
    )


def outside(beside: Iterable[Beside]) -> list[str]:
    """A sentence on the values that all tests together leave out, where there are such."""
    parts = [
        f"{label(b.parameter)} {b.handed_out:.3g} (all tests: {b.all_tests_95[0]:.3g} to "
        f"{b.all_tests_95[1]:.3g})"
        for b in beside
        if not b.inside
    ]
    said = "The values handed out meet one test; all tests together ask for others"
    return [f"{said}: {', '.join(parts)}."] if parts else []


def nothing_wrong(tests: Sequence[Test]) -> str:
    """What is said where nothing speaks against the parameters, with what was not asked."""
    measured = [t for t in tests if t.measured is not None]
    met = [t for t in measured if t.state == "met"]
    if not met:
        return "No measured value could be held against the parameters."
    said = f"{len(met)} of {len(measured)} measured values are met."
    left = [title(t) for t in measured if t.state != "met"]
    return f"{said} Not judged: {'; '.join(left)}." if left else said


def said_by_diagnosis(verdict: Mapping[str, Any]) -> list[str]:
    """Sentences of a mapping of verdict.json: its own first lines, or of one without them the
    verdict with causes and reason."""
    if verdict.get("first_lines"):
        return verdict["first_lines"]
    causes = " and ".join(label(c) for c in verdict.get("causes", []))
    parts = [verdict["verdict"], causes, verdict.get("reason", "").strip().rstrip(".")]
    return [f"The diagnosis: {': '.join(p for p in parts if p)}."]


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
    low, high = (f"{end:.3g}" for end in parameter.interval_95)
    if parameter.bounded is False:
        return f"not bounded by what was measured: {low} to {high}"
    of = OF[parameter.interval_of] if parameter.interval_of else ""
    return f"95 %{' ' if of else ''}{of}: {low} to {high}"


def beside(found: Beside) -> dict[str, str]:
    """A row of what all tests together give, in words."""
    low, high = (f"{end:.3g}" for end in found.all_tests_95)
    return {
        "parameter": label(found.parameter),
        "handed out": f"{found.handed_out:.3g}",
        "all tests, 95 %": f"{low} to {high}",
        "": "inside" if found.inside else "outside",
    }


def calibrated(answer: Answer) -> list[Parameter]:
    """The parameters that the study calibrated."""
    return [p for p in answer.parameters if p.source == "calibrated"]


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


def following(answer: Answer) -> str:
    """The measurement to make next, in a sentence; "" without one."""
    found = answer.next
    if found is None:
        return ""
    test = f"{label(found.test)}, {response_of(found.metric).name}"
    return (
        f"{capital(test)}, {found.readings} readings in {found.hours:g} h: expected to leave "
        f"{100 * found.left:.0f} % of the spread of {label(found.parameter)}."
    )


def lines(answer: Answer) -> list[str]:
    """The answer in few lines of plain text."""
    by = "all tests together" if answer.by == "joint" else "one test"
    said = [f"{p.name} {value(p)}, {known(p)}" for p in calibrated(answer)]
    found = [f"{answer.study}, calibrated to {by}: {'; '.join(said)}"]
    for test in answer.tests:
        row = compared(test)
        against = f"measured {row['measured']}, " if row["measured"] else ""
        predicted = row["predicted"] or "no run"
        found.append(f"{row['']} {row['test']}: {against}predicted {predicted}, {row['verdict']}")
    found.append(f"what is wrong: {answer.wrong.sentence}")
    if answer.next:
        found.append(f"next: {following(answer)}")
    return found


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


def capital(text: str) -> str:
    """With a capital letter first, the others as they are."""
    return text[:1].upper() + text[1:]


def given_nowhere(summary: Mapping[str, Any]) -> bool:
    """Whether no point of the region is predicted to give the target. Of several targets the
    optimum is a compromise, and its solution set is what is nearly as desirable."""
    return "desirability" not in summary and not summary.get("attainable", True)


def out_of_reach(summary: Mapping[str, Any], response: Response) -> str:
    """A sentence on a target that the surface gives nowhere in the region: how near it comes, and
    how well it knows that."""
    low, high = (response.value(end) for end in summary["confirmation_interval"])
    return (
        f"No point of the region is predicted to give {response.value(summary['target'])}: the "
        f"chosen one comes nearest, with {response.value(summary['predicted'])} (95 % {low} to "
        f"{high})."
    )
