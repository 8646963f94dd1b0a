"""What a test method tells of itself: its questions, and what the answers become in a study. The
options of `dem new` and its table are made from `methods.yaml`, and nothing else lists them."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from calibration.errors import CalibrationError
from calibration.intake.tables import said_number
from dem.units import UNITS, UnitError, behind, has_unit, in_ascii, question, unit_of, without_unit

LARGEST = 1e6
"""Of any number in its question's unit: what is beyond is no laboratory's."""

_SEVERAL = {
    "date": re.compile(r"\A\d{4}-\d\d-\d\d"),
    "spread": re.compile(r"±|\+\s*/?\s*-"),
    "range": re.compile(r"\d\s*(?:-|–|\bto\b|\bbis\b|\.\.)\s*\d"),
}
"""What several numbers are -> how they are written."""
_OF_HEADING = re.compile(r" \[[^\]]*\]\Z")
_SLOPE = re.compile(r"([\d.,]+)\s*(?:%|percent)")


@dataclass(frozen=True)
class Question:
    """One question of a method.

    key: its name in options and its rows in a table; text: how it is asked; unit: a key whose
    ending is the answer's unit and whose plausible values are known (`drop_height_mm`), empty for a
    number without a unit; words: the answers that are allowed, in place of a number; free: any
    text; reading: whether it is what was read, of which there may be several; needed: whether the
    method says nothing without it; least (not itself unless `whole`), most: of the number; whole: a
    count; option: its own option of `dem new`, where it has one; example: an answer; headings: what
    tables call it beside its key and unit's name, in small letters; at_its_word: whether a value
    beyond the plausible ones is taken where its unit stands behind it.
    """

    key: str
    text: str
    unit: str = ""
    words: tuple[str, ...] = ()
    free: bool = False
    reading: bool = False
    needed: bool = False
    least: float = 0.0
    most: float = math.inf
    whole: bool = False
    option: str = ""
    example: str = ""
    headings: tuple[str, ...] = ()
    at_its_word: bool = False

    @property
    def allowed(self) -> str:
        """In words."""
        if self.words:
            return ", ".join(self.words)
        if self.free:
            return "text"
        kind = "a whole number" if self.whole else "a number"
        unit = in_ascii(unit_of(self.unit)) if self.unit else ""
        limits = f", {max(self.least, 0):,.9g} to {self.most:,.9g}" if self.most < math.inf else ""
        return f"{kind}{f' in {unit}' if unit else ''}{limits}"

    def read(self, text: str) -> float | str:
        """The value of an answer, behind which the unit of its heading may stand in brackets.
        Raises CalibrationError for what cannot be one, is doubtful, or has no unit."""
        text = text.strip()
        if self.words:
            word = text.casefold()
            if word not in self.words:
                raise CalibrationError(f"{text}: is not known; allowed: {self.allowed}")
            return word
        return text if self.free else self._number(text)

    def _number(self, text):
        heading, unit = _OF_HEADING.search(text), unit_of(self.unit)
        text = text[: heading.start()] if heading else text
        if several := next((name for name, own in _SEVERAL.items() if own.search(text)), None):
            raise refusal(several, text)
        if unit == "°" and (found := _SLOPE.fullmatch(text.strip())):
            # a percentage in place of an angle is a slope, which converts to none as units do
            slope = float(found[1].replace(",", "."))
            raise refusal("slope", text, slope, math.degrees(math.atan(slope / 100.0)))
        try:
            value = said_number(text, unit)
        except UnitError as error:
            allowed = "" if "allowed" in str(error) else f"; allowed: {self.allowed}"
            raise CalibrationError(f"{text}: {error}{allowed}") from None
        if not math.isfinite(value):
            raise CalibrationError(f"{text}: is not a number; allowed: {self.allowed}")
        asked, told = question(self.unit, value), has_unit(text.replace(",", "."))
        if asked and not told:
            raise CalibrationError(f"{text}: is doubtful: {asked}; its unit behind it settles it")
        if unit not in (None, "°") and not (told or heading):  # an angle is in degrees
            raise refusal("no_unit", text, in_ascii(unit))
        if asked and not self.reading and not self.at_its_word:
            # the study's own check would refuse it later, and not say where it was told
            raise CalibrationError(f"{text}: is out of range: {asked}")
        low = value >= self.least if self.whole else value > self.least
        most = min(self.most, LARGEST)
        if not (low and value <= most) or (self.whole and value != round(value)):
            least = max(self.least, 0)
            raise refusal("out_of_range", text, least, most, behind(unit), self.whole)
        return value


@dataclass(frozen=True)
class Answer:
    """An answer as it was given, its value, and where it stands: an option, a cell, a field."""

    text: str
    value: Any  # a number [the question's unit], or a word
    place: str


@dataclass(frozen=True)
class Entry:
    """One test: its method and the answers {question's key: [Answer]}."""

    method: "Method"
    answers: Mapping[str, list[Answer]]

    def values(self, key: str) -> list[Any]:
        """All values of a question, none where it was not answered."""
        return [a.value for a in self.answers.get(key, ())]

    def value(self, key: str, otherwise: Any = None) -> Any:
        """The value of a question with one answer; `otherwise` where there is none."""
        return next(iter(self.values(key)), otherwise)

    def place(self, key: str) -> str:
        """Where a question was answered."""
        return next((a.place for a in self.answers.get(key, ())), f"{self.method.title}, {key}")


@dataclass(frozen=True)
class LaboratoryTest:
    """What an entry becomes in a study.

    rig: name of the rig; experiment and run: how it is simulated; rows: rows of the table of
    measured values; metrics: those of its rig that the joint study is calibrated to; discrepancy:
    {metric: standard deviation} by which the rig may be wrong; ranges: {key of a run spec: (low,
    high, source)} of factors that it measures; known: {key: (value, standard error)} of those that
    it tells by itself; went: {question's key: where its answer went}; said: sentences for the
    screen; wall: what the wall is of, where the test touches one.
    """

    rig: str
    experiment: str
    run: dict
    rows: list[dict]
    metrics: tuple[str, ...]
    went: dict[str, str]
    discrepancy: dict[str, float] = field(default_factory=dict)
    ranges: dict[str, tuple[float, float, str]] = field(default_factory=dict)
    known: dict[str, tuple[float, float]] = field(default_factory=dict)
    said: tuple[str, ...] = ()
    wall: str | None = None


@dataclass(frozen=True)
class Method:
    """A way to measure.

    name: its option and its name in a table; title: for a heading; about: what is done, in a
    sentence; questions; becomes: name of a function (entry, grains) -> `LaboratoryTest`, empty
    where the answers describe the grain, and a single reading needs a stated spread elsewhere;
    own_options: whether each question is an option of `dem new` by itself; rank: the order in which
    methods are asked, and the lowest rank that was measured is what the study's chain is calibrated
    to; leads: whether it can be; under: key of the question whose answers tell several rigs of the
    method apart, a load or a height, empty where there is one rig; scatter: name of a function
    (conditions (n,), readings (n,)) -> standard deviation (n,) of single readings, one each at
    several answers of `under`, by `scatter_about`.
    """

    name: str
    title: str
    about: str
    questions: tuple[Question, ...]
    rank: int
    becomes: str = ""
    own_options: bool = False
    leads: bool = False
    under: str = ""
    scatter: str = ""
    scatter_about: str = ""

    @property
    def readings(self) -> tuple[Question, ...]:
        """The questions that are read, several times where the laboratory did."""
        return tuple(q for q in self.asked if q.reading)

    @property
    def asked(self) -> tuple[Question, ...]:
        """All questions, those of a stated spread among them."""
        if not self.becomes:
            return self.questions
        first = next(q for q in self.questions if q.reading)
        return (*self.questions, *spread_of(first))

    def question(self, key: str) -> Question | None:
        """The question of a key, None where there is none."""
        return next((q for q in self.asked if q.key == key), None)


def spread_of(reading: Question) -> tuple[Question, Question]:
    """The questions of a stated spread: standard deviation of one reading, and of how many the
    value is the mean."""
    # its unit alone: a spread may be smaller than any plausible value
    unit = next((f"spread{ending}" for ending in UNITS if reading.unit.endswith(ending)), "")
    return (
        Question("sd", "standard deviation of one reading, where the value is a mean or the only "
                 "one", unit=unit, option="sd" if reading.option else ""),
        Question("n", "of how many readings the value is the mean", whole=True, least=1, most=1e6,
                 option="n" if reading.option else ""),
    )  # fmt: skip


def rows_of(entry: Entry, key: str, experiment: str, **levers: float) -> list[dict]:
    """Rows of the table of measured values: one a reading, or one mean with its spread."""
    metric = entry.method.question(key).unit  # type: ignore[union-attr]  # it was answered
    unit = in_ascii(unit_of(metric))
    shared: dict[str, Any] = {"experiment": experiment, "quantity": without_unit(metric)}
    shared |= {"unit": unit} | levers
    values, sd = entry.values(key), entry.value("sd")
    if sd is None:
        return [shared | {"value": a.value, "note": a.place} for a in entry.answers[key]]
    shared["note"] = entry.place(key)
    return [shared | {"value": values[0], "sd": sd, "n": int(entry.value("n", 1))}]


def simulated(
    entry: Entry, key: str, rig: str, experiment: str, run: dict, rows: list[dict], **more: Any
) -> LaboratoryTest:
    """`LaboratoryTest` whose target is what was read as `key`; `more` is the rest of it. The rig
    takes each answer as it was given, but for those that `went` tells."""
    metric = entry.method.question(key).unit  # type: ignore[union-attr]  # it was answered
    went = dict.fromkeys(entry.answers, "as given") | {key: "a target"}
    went |= {"wall": "the wall that friction and restitution are of"} | more.pop("went", {})
    parts = {"metrics": (metric,), "went": went, "wall": entry.value("wall")} | more
    return LaboratoryTest(rig, experiment, run, rows, **parts)


def said(name: str, *given: Any, template: str = "said") -> tuple[str, ...]:
    """The lines of a macro of `said.j2`: what is said of a study that begins."""
    from calibration.engines.templates import macros  # what makes options needs none

    text: str = getattr(macros("calibration.study.new", template), name)(*given)
    return tuple(text.splitlines())


def fault(name: str, *given: Any) -> str:
    """The sentence of a macro of `refused.j2`: what cannot be a study."""
    return " ".join(said(name, *given, template="refused"))


def refusal(name: str, *given: Any) -> CalibrationError:
    """The error of a `fault`."""
    return CalibrationError(fault(name, *given))
