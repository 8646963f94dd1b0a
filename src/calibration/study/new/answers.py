"""What a laboratory answered, in options or a table: checked entries, or every fault at once
with its place."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import CalibrationError
from calibration.study.new.assumed import ASSUMED
from calibration.study.new.methods import Answer, Entry, Method, Question, function_of, methods
from calibration.study.new.methods.declare import fault, refusal, spread_of
from dem.units import has_unit, in_ascii, unit_of


@dataclass(frozen=True)
class Raw:
    """Answers as they were given: the method's name, {question's key: [(text, place)]} and the
    place of the whole."""

    method: str
    answers: Mapping[str, Sequence[tuple[str, str]]]
    place: str


def read_entries(raws: Iterable[Raw], faults: Iterable[str] = ()) -> list[Entry]:
    """[Entry] of all that was answered. Raises CalibrationError of all faults, one a line, those
    that were found before among them."""
    faults, entries = list(faults), []
    for raw in raws:
        before = len(faults)
        entry = _entry(raw, faults)
        if len(faults) == before:  # what could not be read is no lack of readings
            entries.append(entry)
    found = _with_scatter(entries)
    faults += [told for entry in found if (told := _spread_fault(entry))] + _twice(found)
    if faults:
        raise CalibrationError("\n".join(faults))
    return found


def _entry(raw, faults):
    method = methods()[raw.method]
    answers = {
        k: own for k, texts in raw.answers.items() if (own := _read(method, k, texts, raw, faults))
    }
    for q in method.questions:
        if q.needed and not raw.answers.get(q.key):
            by_itself = q.option and all(p.option for p in method.asked if p.key in raw.answers)
            option = by_itself and raw.place.startswith("option ")
            faults.append(fault("missing", raw.place, q, option))
    faults += _uneven(method, answers, raw)
    return Entry(method, answers)


def _read(method, key, texts, raw, faults):
    """[Answer] of a question's texts; what cannot be read goes to `faults`."""
    q = _question(method, key, raw.answers)
    if q is None:
        known = [q.key for q in method.asked]
        near = difflib.get_close_matches(key, known, n=1)
        faults.append(fault("no_question", texts[0][1], key, method, near, known))
        return []
    found = []
    for text, place in texts:
        if text.strip() in (*(q.key for q in method.asked), "="):
            faults.append(fault("alone", place, text.strip(" =")))
            continue
        try:
            found.append(Answer(text.split(" [")[0].strip(), q.read(text), place))
        except CalibrationError as error:
            own = f"{text.strip()}: " if place.endswith(text) else ""
            faults.append(f"{place}: {str(error).removeprefix(own)}")
    if len(found) > 1 and not q.reading:
        faults.append(fault("answered_twice", found[1].place, key))
    return found


def _told(answer):
    """An answer with its place, where that does not end with it already."""
    place, text = answer.place, answer.text
    return place if place.endswith(text) else f"{place}: {text}"


def _question(method, key, answers):
    """The question of a key; a stated spread has the unit of the reading that was answered."""
    read = next((q for q in method.questions if q.reading and answers.get(q.key)), None)
    if method.becomes and key in ("sd", "n") and read:
        return dict(zip(("sd", "n"), spread_of(read), strict=True))[key]
    return method.question(key)


def _uneven(method, answers, raw):
    """A fault where a method's columns of one row are not all there: axes, sieves."""
    together = [] if method.becomes else method.readings
    counts = {q.key: len(answers.get(q.key, ())) for q in together if q.needed or q.key in answers}
    if len(together) > 1 and len(set(counts.values())) > 1:
        return [fault("uneven", raw.place, counts)]
    return []


def _spread_fault(entry):
    """A single reading says nothing of its error, and several say it themselves."""
    method, answers = entry.method, entry.answers
    read = next((answers[q.key] for q in method.readings if q.key in answers), [])
    sd, n, several = entry.values("sd"), entry.values("n"), len(read) > 1
    if not method.becomes:
        return None
    if len(read) == 1 and not sd:
        under = method.under if method.scatter else ""
        return fault("no_spread", _told(read[0]), ASSUMED.loads_that_scatter, under)
    if sd and not sd[0] < read[0].value:
        return fault("wide_spread", entry.place("sd"), read[0].value, sd[0])
    if several and len({a.value for a in read}) == 1 and not (sd or n):
        return fault("alike", _told(read[-1]), len(read), read[0].value)
    if several and (sd or n):
        return fault("two_spreads", entry.place("sd" if sd else "n"), len(read))
    return None


def _with_scatter(entries):
    """Entries with one reading each at several loads or heights get the spread that these show
    together."""
    out = list(entries)
    for method in {e.method.name: e.method for e in entries if e.method.scatter}.values():
        first = method.readings[0].key
        own = [
            k for k, e in enumerate(out)
            if e.method is method and len(e.values(first)) == 1
            and not e.values("sd") and e.value(method.under) is not None
        ]  # fmt: skip
        if len({out[k].value(method.under) for k in own}) < ASSUMED.loads_that_scatter:
            continue
        under = np.array([out[k].value(method.under) for k in own], float)
        read = np.array([out[k].value(first) for k in own], float)
        text = f"scatter about {method.scatter_about.format(n=len(own))}"
        found = np.maximum(function_of(method.scatter)(under, read), ASSUMED.least_spread * read)
        for k, sd in zip(own, found, strict=True):
            answer = Answer(text, float(f"{sd:.6g}"), text)
            out[k] = Entry(method, dict(out[k].answers) | {"sd": [answer]})
    return out


def _twice(entries):
    """Faults of a method that was answered twice in the same rig."""
    seen, faults = {}, []
    for entry in entries:
        under = entry.method.under
        own = entry.method.name, entry.value(under) if under else None
        if own in seen and not (under and own[1] is None):
            first = next(iter(seen[own].answers.values()))[0].place
            here = next(iter(entry.answers.values()), [Answer("", "", entry.method.title)])[0].place
            q = entry.method.question(under)
            at = f"{own[1]:g} {unit_of(q.unit)}" if q else ""
            faults.append(fault("told_twice", here, entry.method.name, first, q, at))
        seen[own] = entry
    return faults


_PARTS = re.compile(r"\s*[x×*]\s*")


def words_of(method: Method, words: Iterable[str], place: str) -> Raw:
    """`Raw` of a method's words, as options and forms give them: readings, and `key=value`.

    Several columns of a row stand in one word: 6.2x3.3x2.9mm.
    """
    answers: dict[str, list[tuple[str, str]]] = {}
    # the columns of a grain's row belong together; of a test, the first is what is read
    readings = method.readings[:1] if method.becomes else method.readings
    for word in words:
        key, mark, text = word.partition("=")
        if mark and re.fullmatch(r"[a-z_]+", key.strip()):
            for one in separate(text):
                answers.setdefault(key.strip(), []).append((one, f"{place} {word}"))
        else:
            whole = len(readings) > 1 and len(_PARTS.split(word)) in _lengths(readings)
            for one in [word] if whole else separate(word):
                _row(readings, one, f"{place} {word}", answers)
    return Raw(method.name, answers, place)


def _lengths(readings):
    """Numbers that a row may have: all, or those that are needed."""
    return (len(readings), sum(q.needed for q in readings))


def _row(readings, word, place, answers):
    """Put the columns of one row where they belong; a unit behind the last counts for all. Raises
    CalibrationError for a row of another length."""
    if len(readings) < 2:
        answers.setdefault(readings[0].key, []).append((word, place))
        return
    parts = _PARTS.split(word)
    if len(parts) not in _lengths(readings):
        columns, example = zip(*((q.key, q.example.split()[0]) for q in readings), strict=True)
        raise refusal("short_row", place, len(parts), columns, example)
    unit = re.sub(r"^[\d.,\s+-]+", "", parts[-1])
    for q, part in zip(readings, parts, strict=False):
        bare = not re.search(r"[A-Za-zµ%°]", part)
        text = f"{part} {unit}" if bare and unit and q.unit else part
        answers.setdefault(q.key, []).append((text, place))


def separate(text: str) -> list[str]:
    """Words of one text that are numbers side by side: `26.1,27.4`, `26,1;27,4`. One comma between
    digits alone is a decimal mark, as in tables. Raises CalibrationError for `26,1,27,4`."""
    if ";" in text:
        return [t for part in text.split(";") if (t := part.strip())]
    parts = text.split(",")
    if len(parts) > 3 and len(parts) % 2 == 0 and all(p.strip().isdigit() for p in parts):
        decimals = [f"{a}.{b}" for a, b in zip(parts[::2], parts[1::2], strict=True)]
        raise refusal("two_ways", text, parts, decimals)
    if len(parts) > 2 or (len(parts) == 2 and any("." in p for p in parts)):
        thousands = all(re.fullmatch(r"\d{3}", p) for p in parts[1:])
        return [text] if thousands else [t for p in parts if (t := p.strip())]
    return [text]


def with_unit(q: Question | None, text: str, unit: str | None) -> str:
    """A cell's text with its heading's unit: in brackets where that is the question's own, as who
    fills in a column may not have read it."""
    if q is None or not unit or not q.unit or has_unit(text.replace(",", ".")):
        return text
    own = unit_of(q.unit)
    return f"{text} [{own}]" if unit in (own, in_ascii(own)) else f"{text} {unit}"


def entries_of(
    place: str, method: Method, filled: list[tuple[int, dict]], faults: list[str]
) -> list[Raw]:
    """[Raw] of the rows of a sheet or table: of a grain all rows together, of a test those of the
    same conditions, which empty cells take from the row above. filled: (line, {question's key:
    (text, place)}); a row without a reading goes to `faults`."""
    readings = {q.key for q in method.readings}
    if not method.becomes:
        answers: dict[str, list] = {}
        for _, row in filled:
            for key, answer in row.items():
                answers.setdefault(key, []).append(answer)
        return [Raw(method.name, answers, place)]
    groups: dict[tuple, dict[str, list]] = {}
    conditions: dict[str, tuple[str, str]] = {}
    for line, row in filled:
        own = {k: v for k, v in row.items() if k not in readings and k not in ("sd", "n")}
        conditions = conditions | own
        if not readings & set(row):
            faults.append(f"{place}, line {line}: has no {' or '.join(sorted(readings))}; allowed: "
                          "a reading in each row")  # fmt: skip
            continue
        same = tuple(sorted((k, text) for k, (text, _) in conditions.items()))
        group = groups.setdefault(same, {k: [v] for k, v in conditions.items()})
        for key in row:
            if key not in own:
                group.setdefault(key, []).append(row[key])
    return [Raw(method.name, answers, place) for answers in groups.values()]
