"""The methods' questions as options of `dem new`, and the options' words as answers."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError
from calibration.intake.photo_names import PICTURES
from calibration.study.new.answers import Raw, words_of
from calibration.study.new.grains import FINE_MM
from calibration.study.new.methods import Question, methods
from calibration.study.new.reading_tables import TABLES, is_table, raws_of_tables

MANY = ("measured",)
"""Options of a single question that take several words."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add an option for each question that has one by itself, and for each other method one that
    takes its readings and key=value."""
    for method in methods().values():
        group = parser.add_argument_group(method.title, method.about)
        for q in (q for q in method.questions if q.option):
            shape: dict[str, Any] = {"nargs": "+", "metavar": "X"} if q.option in MANY else {}
            group.add_argument(f"--{q.option}", dest=_dest(q), help=_help(q), **shape)
        if _has_words(method):
            group.add_argument(
                f"--{method.name}", nargs="+", action="append", default=[], metavar="X",
                dest=f"method_{method.name}", help=_words_help(method),
            )  # fmt: skip


def _dest(q):
    return q.option.replace("-", "_")


def _has_words(method):
    return bool(method.becomes or not method.own_options)


def _help(q):
    example = f": {_one_word(q.example)}" if q.example else ""
    return f"{q.text}{example}".replace("%", "%%")


def _one_word(example):
    """An example as it is typed: a value and its unit are one word, a name stays as it is."""
    return example.replace(" ", "") if example[:1].isdigit() else example


def _words_help(method):
    first = method.readings[0]
    rest = [q for q in method.asked if q not in method.readings[:1]]
    if not method.becomes:
        columns = " x ".join(q.key for q in method.readings)
        numbers = "x".join(q.example.split()[0] for q in method.readings)
        unit = method.readings[-1].example.split()[-1]
        return f"{columns}, a word a grain: {numbers}{unit}"
    keys = "; ".join(f"{q.key}= {q.text}" for q in rest)
    return f"{first.text}: {_one_word(first.example)}; beside it {keys}".replace("%", "%%")


def tells_a_laboratory(args: argparse.Namespace) -> bool:
    """Whether the options tell more than a funnel's heap of dry, coarse grains, beside which a bulk
    density alone may stand."""
    told = [name for name in methods() if getattr(args, f"method_{name}", None)]
    if told and told != ["bulk-density"]:
        return True
    funnel = args.measured or args.orifice
    return bool((told and not funnel) or args.moisture or args.plate_of or _is_fine(args.grain))


def tells_anything(args: argparse.Namespace) -> bool:
    """Whether any question is answered by an option."""
    return any(
        getattr(args, f"method_{method.name}", None)
        or any(getattr(args, _dest(q), None) for q in method.questions if q.option)
        for method in methods().values()
    )


def has_workbook(args: argparse.Namespace) -> bool:
    """Whether an option's words name a workbook, which has sheets."""
    words = [str(args.sieve or ""), *(args.measured or [])]
    for method in methods():
        words += [word for told in getattr(args, f"method_{method}", None) or [] for word in told]
    return any(Path(word).suffix.lower() == ".xlsx" for word in words)


def _is_fine(text):
    """Whether a diameter is that of grains that stick; what cannot be read is told later."""
    from calibration.intake.numbers_with_units import said_number
    from dem.units import UnitError, has_unit, question

    try:
        value = said_number(text, "mm") if text else FINE_MM
    except UnitError:
        return False
    return value < FINE_MM and (has_unit(text) or not question("diameter_mm", value))


def raws_of(args: argparse.Namespace) -> list[Raw]:
    """[Raw] of all that the options tell. Raises CalibrationError for angles in a table or in
    photographs that cannot be read."""
    found = []
    for method in methods().values():
        single = _single(method, args)
        entries = getattr(args, f"method_{method.name}", None) or ([[]] if single else [])
        for k, words in enumerate(entries):
            files = [] if _of_heaps(method) else [word for word in words if is_table(word)]
            told = [word for word in words if word not in files]
            raw = words_of(method, told, f"option --{method.name}")
            if files:
                raws, said = raws_of_tables(method, files, raw, getattr(args, "sheet", None))
                found += raws
                print(*said, sep="\n", end="\n" if said else "")
                continue
            answers = dict(_read_files(method, raw, args))
            if twice := answers.keys() & single.keys() if k == 0 else ():
                key = min(twice)
                raise CalibrationError(
                    f"{single[key][0][1]}: {key} stands in --{method.name} too; allowed: one of "
                    "the two"
                )
            answers |= single if k == 0 else {}
            found.append(Raw(method.name, answers, raw.place))
    return found


def _of_heaps(method):
    """Whether a method reads angles of repose: those stand in photographs too."""
    return any(q.unit == "angle_of_repose_deg" for q in method.readings)


def _read_files(method, raw, args):
    """(key, [(text, place)]) with the angles of photographs and of a table in place of their
    names."""
    for key, texts in raw.answers.items():
        q = method.question(key)
        angles = q is not None and q.reading and q.unit == "angle_of_repose_deg"
        files = [t for t, _ in texts if Path(t).suffix.lower() in (*PICTURES, *TABLES)]
        if not (angles and files):
            yield key, texts
            continue
        place = f"{raw.place} {files[0]}" if len(files) == 1 else raw.place
        yield (
            key,
            [(t, p) for t, p in texts if t not in files]
            + [(f"{value:.6g}", place) for value in _angles(files, args)],
        )


def _single(method, args):
    """{key: [(text, place)]} of a method's questions that have options by themselves."""
    return {
        q.key: list(_texts(q, args))
        for q in method.questions
        if q.option and getattr(args, _dest(q), None)
    }


def _texts(q: Question, args: argparse.Namespace) -> Iterator[tuple[str, str]]:
    given = getattr(args, _dest(q))
    place = f"option --{q.option}"
    if q.option == "measured":
        for value in _angles(given, args):
            yield f"{value:.6g}", place
    else:
        yield str(given), place


def _angles(given: Sequence[str], args: argparse.Namespace) -> list[float]:
    """Angles [deg] of numbers, of a table or of photographs."""
    from calibration.study.new.questions import measured_angles

    return measured_angles(list(given), getattr(args, "sheet", None))


def raws_of_heap(
    values: Sequence[float], heap: Any, bulk: Sequence[str], material: str | None
) -> list[Raw]:
    """[Raw] of a funnel's heap that was asked for at the terminal; heap: `Heap`."""
    funnel = {
        "measured": [f"{v:.6g}" for v in values],
        "orifice": [f"{heap.orifice_diameter_mm:g} mm"],
        "plate": [f"{heap.plate_diameter_mm:g} mm"],
        "height": [f"{heap.discharge_height_mm:g} mm"],
    }
    if heap.plate_rim_height_mm:
        funnel["rim"] = [f"{heap.plate_rim_height_mm:g} mm"]
    if heap.mass_flow_g_s is not None:
        funnel["rate"] = [f"{heap.mass_flow_g_s:g} g/s"]
    grain = {"density": [f"{heap.density_kg_m3:g} kg/m3"], "diameter": [f"{heap.diameter_mm:g} mm"]}
    if material:
        grain["material"] = [material]
    told = {"grain": grain, "funnel": funnel} | (
        {"bulk-density": {"density": bulk}} if bulk else {}
    )
    return [
        Raw(name, {k: [(t, f"answer {k}") for t in texts] for k, texts in answers.items()}, name)
        for name, answers in told.items()
    ]
