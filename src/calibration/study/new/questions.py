"""What `dem new` asks: each answer from an option, else from the person at the terminal, checked at
once."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.errors import CalibrationError, ConfigError
from calibration.intake.measurements import read_measured
from calibration.intake.numbers_with_units import said_number
from calibration.intake.photo_names import PICTURES, refuse_twice, without_fits
from calibration.intake.tables import SeveralSheetsError, read_table, summary
from calibration.study.factors import factor_of
from calibration.study.new.answers import far_apart, separate
from calibration.study.new.heap import FEWEST, MOST, Heap
from calibration.study.new.mastersizer import mastersizer_sizes
from calibration.study.new.methods import methods
from calibration.study.new.methods.declare import refuse_slope
from calibration.study.new.ranges import factors_of, materials
from calibration.study.new.reading_tables import TABLES, with_points
from dem.errors import DemError
from dem.units import UnitError, question, unit_of

if TYPE_CHECKING:
    import argparse

    from calibration.study.factors import Factor


SOFTENED_PA = 3.0e6


@dataclass(frozen=True)
class Asked:
    """A declared question as it is asked at the terminal: its option, the key whose unit its answer
    has, and its words."""

    option: str
    key: str
    text: str


def _asked(method, key):
    """`Asked` of a question that a method declares."""
    q = methods()[method].question(key)
    example = f", such as {q.example}" if q.example else ""
    return Asked(q.option, q.unit, f"{q.text[0].upper()}{q.text[1:]}{example}")


DENSITY, GRAIN = _asked("grain", "density"), _asked("grain", "diameter")
RIG = tuple(_asked("funnel", key) for key in ("orifice", "plate", "height"))
MEASURED = _asked("funnel", "measured")
RATE = _asked("funnel", "rate")
"""The one that may stay open: the funnel is then fed safely below what its orifice passes."""
BULK = Asked("bulk-density", "poured_density_kg_m3", "")
RIM = _asked("funnel", "rim")
"""Never asked: options alone."""


def answers(
    args: argparse.Namespace, ask: Callable[[str], str] | None = None
) -> tuple[list[float], Heap, list[Factor], dict[str, Any] | None]:
    """(values (n,) [deg], `Heap`, factors, sizes or None) from options and, where `ask` is given,
    from a person.

    Raises CalibrationError for an option that is missing or cannot be.
    """
    sheet = getattr(args, "sheet", None)
    values = _answer(args.measured, ask, MEASURED, partial(_of_sheet, ask=ask, sheet=sheet))
    sizes = sieve_curve(args.sieve) if args.sieve else None

    def number(q):
        return _answer(getattr(args, q.option), ask, q, partial(_number, q=q))

    grain = {DENSITY.key: number(DENSITY)}
    grain[GRAIN.key] = mean_diameter(sizes) if sizes else number(GRAIN)
    grain |= {"angle_deg": sum(values) / len(values), "shear_modulus_Pa": SOFTENED_PA}
    while True:
        rig = {q.key: number(q) for q in RIG}
        rig[RATE.key] = _open_answer(
            args.rate, ask, f"{RATE.text} (or empty)", partial(_number, q=RATE)
        )
        rig[RIM.key] = _number(args.rim, RIM) if args.rim else 0.0
        heap = Heap(**grain, **rig)
        try:
            _check_rig(heap)
            break
        except CalibrationError as error:
            if not ask or all(getattr(args, q.option) for q in (*RIG, RATE)):
                raise
            print(error)
    known = f"Material ({', '.join(materials())}, or empty)"
    factors = _open_answer(args.material, ask, known, partial(_material, args)) or factors_of(None)
    bounce = factor_of(factors, "contacts.particle_particle.restitution")
    return values, replace(heap, least_restitution=bounce.low), factors, sizes


def _material(args, said):
    """Factors of a material, whose name counts as if an option had told it."""
    factors = factors_of(said)
    args.material = said
    return factors


def _answer(given, ask, q, read):
    """What `read` makes of an option or of an answer to a question. A person is asked again, and
    told why. Raises CalibrationError for an option that is missing or cannot be."""
    if given:
        return read(given)
    if ask is None:
        text = f"{q.text[0].lower()}{q.text[1:]}"
        others = " Another test than a funnel's heap? dem new --help lists all"
        other = f".{others}" if q in (MEASURED, *RIG) else ""
        raise CalibrationError(f"--{q.option} is missing; allowed: {text}{other}")
    while True:
        try:
            return read(ask(q.text))
        except CalibrationError as error:
            print(error)


def _open_answer(given, ask, text, read):
    """The same of what may stay open: None then."""
    if given or not ask:
        return read(given) if given else None
    return _answer(None, ask, Asked("", "", text), lambda said: read(said) if said else None)


def _check_rig(heap):
    """Raise CalibrationError for a rig in which no heap of the measured angle can be poured."""
    plate, orifice = heap.plate_diameter_mm, heap.orifice_diameter_mm
    if plate <= orifice:
        raise CalibrationError(
            f"--plate {plate:g} mm: is no wider than the orifice; allowed: more than {orifice:g} "
            "mm",
            key="--plate", value=plate, allowed=f"more than {orifice:g} mm",
        )  # fmt: skip
    high = heap.apex_mm
    if heap.discharge_height_mm <= high:
        raise CalibrationError(
            f"--height {heap.discharge_height_mm:g} mm: a heap of {heap.angle_deg:.1f}° on the "
            f"plate stands {high:.3g} mm high and would reach the orifice; allowed: more than that",
            key="--height", value=heap.discharge_height_mm, allowed=f"more than {high:.3g} mm",
        )  # fmt: skip
    if heap.mass_flow_g_s is not None and heap.feed_share >= 1.0:
        most = heap.mass_flow_g_s / heap.feed_share
        raise CalibrationError(
            f"--rate {heap.mass_flow_g_s:g} g/s: the orifice passes about {most:.3g} g/s (Beverloo "
            f"1961); allowed: less than that",
            key="--rate", value=heap.mass_flow_g_s, allowed=f"less than {most:.3g} g/s",
        )  # fmt: skip


def at_terminal() -> Callable[[str], str] | None:
    """A function that asks, or None where nobody sits at a terminal."""
    return _ask if sys.stdin.isatty() else None


def _ask(text):
    try:
        return input(f"{text}: ").strip()
    except EOFError:
        raise DemError("the questions ended without an answer; nothing was written") from None


def _number(text, q):
    try:
        value = said_number(text, unit_of(q.key))
    except UnitError as error:
        raise CalibrationError(f"--{q.option} {text}: {error}") from None
    asked = question(q.key, value)
    if asked or not 0 < value < float("inf"):
        raise CalibrationError(
            f"--{q.option} {text}: is doubtful: {asked or 'not above 0; allowed: more than 0'}"
        )
    return value


def most_grains(given: int | None) -> int:
    """Grains to simulate at most. Raises CalibrationError for fewer than make a heap."""
    if given is None:
        return MOST
    if given < FEWEST:
        raise CalibrationError(f"--grains {given}: make no heap; allowed: {FEWEST} or more")
    return given


def bulk_densities(texts: Sequence[str], heap: Heap) -> list[float]:
    """Poured bulk densities [kg/m3] of the grains of `heap`. Raises CalibrationError for one that
    no grain of this density has."""
    values = [_number(text, BULK) for text in texts]
    for text, value in zip(texts, values, strict=True):
        if value >= heap.density_kg_m3:
            raise CalibrationError(
                f"--bulk-density {text}: is not below that of a grain; allowed: less than "
                f"{heap.density_kg_m3:g} kg/m3 (--density)"
            )
    return values


def _of_sheet(given, ask, sheet):
    """`_measured`, of the sheet of a workbook; where several hold cells and none is named, a person
    is asked."""
    try:
        return _measured(given, sheet)
    except SeveralSheetsError as error:
        if ask is None:
            raise
        return _measured(given, ask(f"Sheet with the angles ({error.value})"))


def _measured(given, sheet=None):
    """Angles [deg] of an option's texts, or of one text that was typed or pasted: a name of a file
    that is there, else several words."""
    one = given if isinstance(given, str) else given[0] if len(given) == 1 else None
    if one is None:
        return measured_angles(given, sheet)
    return measured_angles([one] if Path(one).is_file() else _words(one), sheet)


def _words(text):
    """Words as a shell would part them: names with spaces stand between quotation marks."""
    try:
        return shlex.split(text)
    except ValueError:  # a mark that is not closed, or an inch
        return text.split()


def measured_angles(texts: Sequence[str], sheet: str | None = None) -> list[float]:
    """Angles [deg] from numbers, one table (sheet: of a workbook), or photographs. Raises
    CalibrationError."""
    paths = [Path(t) for t in texts]
    if all(p.suffix.lower() in PICTURES for p in paths):
        return _of_photographs(paths)
    if len(paths) == 1 and (paths[0].suffix or paths[0].exists()) and not _is_numbers(texts[0]):
        return _of_table(paths[0], sheet)
    try:
        alone = [word for t in texts for word in (separate(t) if _is_numbers(t) else [t])]
    except CalibrationError as error:
        raise CalibrationError(f"--measured {error}") from None
    return _scattered([_angle(t) for t in alone])


def _scattered(values, place="--measured"):
    """The values. Raises CalibrationError for one alone, or for several that are all the same."""
    if len(values) < 2:
        raise CalibrationError(f"{place}: one value has no spread; allowed: two or more")
    if len(set(values)) == 1:
        raise CalibrationError(
            f"{place}: {len(values)} readings of {values[0]:g}° tell nothing of their scatter; "
            "allowed: finer readings, or in place of them --funnel with one of them, sd (half a "
            f"step of the scale, at least) and n={len(values)}"
        )
    return values


def _of_photographs(paths):
    """Angles [deg] of photographs; says what was left out, and what is not corrected."""
    from calibration.intake.photo import measure_photo  # brings image libraries along
    from calibration.intake.photo.table import uncorrected

    photos, said = without_fits(paths)
    refuse_twice(photos)
    angles = [round(measure_photo(p).angle_deg, 3) for p in photos]
    if len(angles) < 2:
        raise CalibrationError(
            f"{len(angles)} photograph{'' if len(angles) == 1 else 's'} of a heap: one angle has "
            "no spread; allowed: photographs of two heaps or more"
        )
    for sentence in (*said, uncorrected(angles)):
        print(sentence)
    return angles


def _is_numbers(text):
    """Whether a text has digits and marks alone: a number, or several side by side."""
    return bool(re.fullmatch(r"[\d.,;\s°]+", text)) and not Path(text).exists()


def _angle(text):
    if "±" in text or "+-" in text or "+/-" in text:
        allowed = "each reading for itself, such as 26.1 28.4 27.0"
        raise CalibrationError(f"--measured {text}: is a mean with its spread; allowed: {allowed}")
    if Path(text).suffix.lower() in (*PICTURES, *TABLES):
        allowed = "readings, or one table, or photographs alone"
        raise CalibrationError(f"--measured {text}: is a file beside readings; allowed: {allowed}")
    try:
        refuse_slope(text)
        value = said_number(text, "°")
    except (UnitError, CalibrationError) as error:
        said = str(error).removeprefix(f"{text}: ")
        allowed = "" if "allowed" in said else "; allowed: an angle in degrees, such as 26.1"
        raise CalibrationError(f"--measured {text}: {said}{allowed}") from None
    asked = question("angle_of_repose_deg", value)
    if asked or not 0 < value < 90:
        allowed = "no angle of repose; allowed: more than 0 and less than 90°"
        raise CalibrationError(f"--measured {text}: is doubtful: {asked or allowed}")
    return value


def _of_table(path, sheet=None):
    from calibration.intake.numbers_with_units import plausible_numbers

    table = with_points(read_table(path, sheet=sheet))
    if "quantity" in table.header:
        found = read_measured(path, sheet=sheet).of("heap", "angle_of_repose")
        if not found or not all(m.readings for m in found):
            allowed = "rows of heap, angle_of_repose without sd and n"
            raise CalibrationError(f"{path}: holds no angles; allowed: {allowed}")
        return [value for m in found for value in m.readings]
    columns = [h for h in table.header if _of_angles(h) or table.units.get(h) in ("°", "deg")]
    columns = columns or list(table.header)
    if len(columns) != 1:
        raise CalibrationError(
            f"{path}: which column holds the angles? allowed: one with `angle` in its heading, of "
            + ", ".join(table.header)
        )
    for line, text in table.texts(columns[0]):
        try:
            refuse_slope(f"{text} %" if table.units.get(columns[0]) == "%" else text)
        except CalibrationError as error:
            raise CalibrationError(f"{path}, line {line}, column {columns[0]}: {error}") from None
    values = plausible_numbers(table, columns[0], "angle_of_repose_deg")
    return _scattered(values, path)


def _of_angles(heading):
    """Whether a heading names an angle: in English, French or German."""
    return any(word in heading.lower() for word in ("ang", "talus", "winkel"))


SIEVE_HEADINGS = {
    "diameter_mm": {"diameter", "size", "sieve", "durchmesser", "siebweite", "maschenweite",
                    "korngröße", "korngrösse", "diamètre", "diametre", "maille", "taille"},
    "passing_percent": {"passing", "siebdurchgang", "durchgang", "passant", "tamisat"},
    "mass_percent": {"mass", "masse", "massenanteil", "masseanteil", "anteil", "fraction massique"},
    "retained": {"retained", "rückstand", "rueckstand", "siebrückstand", "rest", "refus",
                 "refus partiel"},
}  # fmt: skip
"""Column -> what laboratories call it, in small letters; the unit has to stand behind it."""
SIEVE_UNITS = {"passing_percent": ("%",), "mass_percent": ("%",), "retained": ("%", "g", "kg")}


def _sieve_columns(table):
    """{column as it is here: its heading in the table}. Raises CalibrationError for two headings
    that mean one column, or a heading without the unit that it needs."""
    found = {}
    for heading in table.header:
        known = (c for c, names in SIEVE_HEADINGS.items() if heading.lower() in names)
        column = heading if heading in SIEVE_HEADINGS else next(known, None)
        where = {"path": table.path, "line": table.header_line, "column": heading}
        if column in found:
            raise ConfigError(f"means the same as {found[column]}", **where, allowed="one of them")
        if column and heading != column:
            unit, needed = table.units.get(heading), SIEVE_UNITS.get(column)
            if not unit or (needed and unit not in needed):
                allowed = (
                    f"{heading} in {' or '.join(needed or ('mm',))}, as {heading} "
                    f"[{(needed or ('mm',))[0]}]"
                )
                raise ConfigError("has no unit that tells what it is", **where, allowed=allowed)
        found |= {column: heading} if column else {}
    return found


def sieve_curve(path: str | Path) -> dict[str, Any]:
    """`particles.sizes` of a sieve table or of what a Mastersizer exports: the column
    `diameter_mm`, and `mass_percent` of each size or `passing_percent` of each sieve.

    Raises CalibrationError where they do not make 100 %.
    """
    return _distribution(path, *(mastersizer_sizes(path) or _sieved(path)))


def size_distribution(
    sieves: Sequence[float], passing: Sequence[float], where: str | Path
) -> dict[str, Any]:
    """`particles.sizes` of what passes each sieve [mm, %]; where: for messages. Raises
    CalibrationError."""
    return _distribution(where, *_between_sieves(where, sieves, passing))


def _distribution(path, sizes, shares):
    total = sum(shares)
    if abs(total - 100) > 1 or min(shares) < 0:
        near = "; are they shares of 1?" if abs(total - 1) < 0.01 else ""
        raise CalibrationError(f"{path}: the fractions make {total:g} %; allowed: 100 %{near}")
    kept = [(d, s / total) for d, s in zip(sizes, shares, strict=True) if s > 0]
    fractions = [round(s, 6) for _, s in kept]
    fractions[-1] = round(1.0 - sum(fractions[:-1]), 6)
    return {"by": "mass", "diameters_mm": [d for d, _ in kept], "fractions": fractions}


def _sieved(path):
    """(diameters [mm], mass shares [%]) of a table of sieves."""
    from calibration.intake.numbers_with_units import plausible_numbers

    table = with_points(read_table(path))
    columns = _sieve_columns(table)
    share = next((c for c in ("passing_percent", "retained") if c in columns), "mass_percent")
    passing = share != "mass_percent"
    for needed in ("diameter_mm", share):
        if needed not in columns:
            table.require(needed)
    sizes = plausible_numbers(table, columns["diameter_mm"], "diameter_mm")
    for (line, _), size in zip(table.rows, sizes, strict=True):
        # what passes no sieve may stand beside the pan, a sieve of 0
        if size < 0 or (size == 0 and not passing):
            raise ConfigError("is no size", path=path, line=line, column=columns["diameter_mm"],
                              value=size, allowed="more than 0 mm")  # fmt: skip
    shares = table.numbers(columns[share])
    if share == "retained":
        shares = _passing(table, columns[share], sizes, shares)
    return _between_sieves(path, sizes, shares) if passing else (sizes, shares)


def _passing(table, heading, sieves, retained):
    """What passes each sieve [%] of what stays on it, in % or in masses. Raises ConfigError for
    shares that do not make a whole, or none at all."""
    total, unit = sum(retained), table.units[heading]
    for (line, row), mass in zip(table.rows, retained, strict=True):
        if mass < 0:
            raise ConfigError("is no mass", path=table.path, line=line, column=heading,
                              value=row[heading], allowed="0 or more")  # fmt: skip
    if not total > 0 or (unit == "%" and abs(total - 100) > 1):
        hint = "; is it the sum over the coarser sieves?" if total > 101 and unit == "%" else ""
        raise ConfigError(
            f"the masses on the sieves make {total:g} {unit}{hint}", path=table.path,
            line=table.header_line, column=heading,
            allowed="what stays on each sieve by itself, 100 % together" if unit == "%"
            else "masses of 0 or more, and one above 0",
        )  # fmt: skip
    return [
        100.0 * sum(m for s, m in zip(sieves, retained, strict=True) if s < sieve) / total
        for sieve in sieves
    ]


def _between_sieves(path, sieves, passing):
    """(sizes, shares) of the classes between neighbouring sieves: the geometric mean of the two,
    and what passes the one and not the other. The sieves may stand in either order."""
    rows = sorted(zip(sieves, passing, strict=True))
    if twice := next((a[0] for a, b in pairwise(rows) if a[0] == b[0]), None):
        raise CalibrationError(
            f"{path}: the sieve of {twice:g} mm stands twice; allowed: a row for each sieve"
        )
    if any(b[1] < a[1] for a, b in pairwise(rows)):
        raise CalibrationError(
            f"{path}: less passes a wider sieve than a narrower one; allowed: passing_percent that "
            f"rises with diameter_mm (mass_percent where each row is a size)"
        )
    if rows[0][1] > 0:
        finest = f"{rows[0][0]:g} mm"
        raise CalibrationError(
            f"{path}: {rows[0][1]:g} % pass the finest sieve ({finest}), and no size is known of "
            f"them; allowed: a last row with 0 %, such as that of the pan at the finest grain"
        )
    if rows[-1][1] < 99:
        near = "; are they shares of 1?" if abs(rows[-1][1] - 1) < 0.01 else ""
        raise CalibrationError(
            f"{path}: {rows[-1][1]:g} % pass the widest sieve ({rows[-1][0]:g} mm), and no size is "
            f"known of the rest; allowed: a row with 100 %, the sieve that all of it passes{near}"
        )
    if rows[0][0] == 0 and len(rows) > 1 and rows[1][1] > 0:
        raise CalibrationError(
            f"{path}: {rows[1][1]:g} % pass the finest sieve ({rows[1][0]:g} mm) into the pan, "
            "whose size is 0; allowed: the size of the finest grain in its place"
        )
    sizes = [round(math.sqrt(a[0] * b[0]), 4) for a, b in pairwise(rows)]
    return sizes, [b[1] - a[1] for a, b in pairwise(rows)]


def mean_diameter(sizes: Mapping[str, Any]) -> float:
    """Diameter [mm] of the grain of mean volume: as many of them make the same mass."""
    d, w = sizes["diameters_mm"], sizes["fractions"]
    return (1.0 / sum(f / x**3 for f, x in zip(w, d, strict=True))) ** (1 / 3)


def said_back(values: Sequence[float]) -> str:
    """The measured values, said back; a question behind those that are far apart."""
    return "\n".join(filter(None, (f"measured: {summary(values, '°')}", far_apart(values, "°"))))
