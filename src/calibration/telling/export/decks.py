"""Decks: folders with all that another program needs to pour the calibrated heap, and one command
that holds its heaps against the calibrated ones.

A law of the same name is not the same law: LAMMPS' rolling spring is a constant, and its heaps are
flatter with the same numbers. Who wants the numbers that LAMMPS or LIGGGHTS asks for calibrates in
it (`engine`).

A heap's angle and profile are read by two readers that share no line of code. The first is the
measure of this engine's heaps: lines along the flanks of silhouettes, and along the mean surface.
The second takes grains alone: a straight line along the envelope, the highest grain in each ring
about the axis, and the foot, the radius that holds most of the grains' volume. A heap that is flat
in its lower half and steep at the top has the same flanks as a cone by the first, and another
envelope.

Each quantity has its margin: what a single heap of the calibrated model scatters (two standard
deviations), and no less than the study's margin for an angle, half a grain for a height and a grain
for the foot. It is held where the 90 % interval of the difference of the means lies within the
margin (two one-sided tests at 5 %).

`trials.json` beside this file holds profiles of each rolling law of this engine with a deck's
numbers as they are, and what the codes make of it: what heaps that were poured in other codes say
of the deck of another study. `benchmarks.decks` pours them again.
"""

import hashlib
import math
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill
from typing import Any

import numpy as np
import scipy

from calibration import engines
from calibration.engines import EngineError, rig
from calibration.engines.conversion import Conversion, Granulate, left_out
from calibration.engines.templates import macros
from calibration.files import DamagedError, read_json, write_text
from calibration.runs.simulated import named, simulate
from calibration.runs.store import RunStore
from calibration.statistics.equivalence import compare
from calibration.study.config import overlay
from calibration.telling.export.parameters import to_yaml
from dem.errors import DemError, InputError, MeasureError
from dem.experiments.heap import Rig
from dem.grains.sizes import mean_radius
from dem.io.files import write_json
from dem.measure.heap import measure_heap
from dem.render import read_run
from dem.render.image import plate_of
from dem.spec import RunSpec, load_spec, parse_spec

PROGRAMS = {"liggghts": "liggghts", "lammps": "lmp"}
DECKS = tuple(PROGRAMS)
"""Codes that have decks."""
NAMES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
"""Of YADE heaps are tried, and no deck is written."""
ONE_HEAP = 0.95
"""Share of single heaps of the calibrated model that lie within what a check allows."""
SEEDS = 8
"""Heaps of a check, in each code."""
FEWEST = 4
"""Heaps of a code with which a difference can be tested."""


def write_decks(
    spec: RunSpec,
    conversion: Conversion,
    about: Sequence[str],
    expected: Mapping[str, Any],
    folder: str | Path,
) -> None:
    """Write a deck of a calibrated `RunSpec` for each code into `folder`/<code>.

    conversion: `Conversion` of rolling friction; about: lines of provenance; expected: what the
    calibrated model gives: metric, mean, sd, runs, margin, unit, and `heaps`, the profiles of its
    heaps. What a code cannot represent is named in its README.md, and there is no deck.
    """
    for code, place in ((code, Path(folder) / code) for code in DECKS):
        shutil.rmtree(place, ignore_errors=True)  # the deck of another point, and what that gave
        place.mkdir(parents=True)
        try:
            _refuse(code, spec, expected)
        except EngineError as error:
            write_text(_words().refused(NAMES[code], error), place / "README.md")
            continue
        pour_file(code, spec, conversion, about, place)
        write_text(to_yaml(spec.model_dump(mode="json")), place / "spec.yaml")
        kept = {"code": code, "about": list(about), "rolling": conversion.found, "heaps": []}
        write_json(place / "expected.json", kept | dict(expected))
        write_text(_words().check(NAMES[code]), place / "check.py")
        write_text(_readme(code, conversion, expected, place), place / "README.md")


def _readme(code, conversion, expected, place):
    """The README.md of a deck in the folder `place`; its first lines say what is known of it."""
    known = told(code, NAMES[code], conversion, expected)
    state = _words().state(NAMES[code], known, expected)
    state = "\n\n".join(p if p[0] == "|" else fill(p, 100) for p in state.split("\n\n"))
    program, files = PROGRAMS[code], [p.name for p in sorted(place.iterdir())]
    notes = conversion.sentences("elastic-plastic")
    return _words().readme(NAMES[code], code, program, state, expected, files, notes)


def _refuse(code, spec, expected):
    if spec.experiment != "heap":
        raise EngineError(f"a deck pours a heap; this study calibrates a {spec.experiment}")
    rig.refuse_lost(spec, NAMES[code], code)
    if not expected["metric"].endswith("_deg"):
        raise EngineError(f"a check compares an angle, not {expected['metric']}")


def _words():
    return macros("calibration.telling.export", "decks")


def engine_of(code: str) -> Any:
    """Module of the engine that runs a code's decks."""
    return import_module(f"{engines.__name__}.{code}")


def pour_file(
    code: str, spec: RunSpec, conversion: Conversion, about: Sequence[str], place: Path
) -> None:
    """Write what the program itself reads into the folder `place`: deck, material block and what
    these name."""
    lines = [*about, *left_out(spec, code)]
    engine = engine_of(code)
    engine.deck(spec, place, engine.block(Granulate(spec), conversion, lines))


def scatter_of_one(expected: Mapping[str, Any]) -> float:
    """Half width of the interval in which ONE_HEAP of single heaps of the calibrated model lie."""
    n = expected["runs"]
    quantile = scipy.stats.t.ppf(0.5 + 0.5 * ONE_HEAP, n - 1)
    return float(quantile * expected["sd"] * math.sqrt(1.0 + 1.0 / n))


@dataclass(frozen=True)
class Deck:
    """A deck as `write_deck` left it."""

    folder: Path
    code: str
    spec: RunSpec
    expected: Mapping[str, Any]

    @classmethod
    def read(cls, folder: str | Path) -> "Deck":
        """The deck in a folder. Raises InputError where there is none."""
        folder = Path(folder)
        path = folder / "expected.json"
        if not path.is_file():
            allowed = "the folder of an exported deck: results/NAME/exports/lammps"
            why = folder / "README.md"  # of what could not be written as a deck
            told = f": {why} says why there is none" if why.is_file() else ""
            raise InputError(f"is no deck{told}", path=folder, allowed=allowed)
        expected = read_json(path)
        if not isinstance(expected, dict) or expected.get("code") not in DECKS:
            raise InputError("says no code", path=path, key="code", allowed=" or ".join(DECKS))
        return cls(folder, expected["code"], load_spec(folder / "spec.yaml"), expected)

    @property
    def name(self) -> str:
        """Of the code, in words."""
        return NAMES[self.code]

    @property
    def conversion(self) -> Conversion:
        """`Conversion` of its rolling friction."""
        return Conversion(self.spec, self.expected["rolling"])


def heaps_there(deck: Deck, seeds: Sequence[int], timeout_s: float) -> list[dict[str, float]]:
    """Profiles of heaps in the target code; a heap without one is told and left out. Raises
    EngineError where the program is missing."""
    engine, found = engine_of(deck.code), []
    version = engine.version()
    for seed in seeds:
        spec = parse_spec(overlay(deck.spec.model_dump(mode="json"), {"seed": seed}))
        with TemporaryDirectory() as folder:
            place = Path(folder)
            pour_file(deck.code, spec, deck.conversion, ["a heap of a check"], place)
            read = [version.encode(), *(path.read_bytes() for path in sorted(place.iterdir()))]
            name = hashlib.sha256(b"\0".join(read)).hexdigest()[:16]
            try:
                kept = deck.folder / "heaps" / f"{name}.json"
                found.append(_kept(kept, deck, partial(engine.start, spec, place, timeout_s)))
            except DemError as error:
                print(f"{deck.name}, seed {seed}: {error}", file=sys.stderr)
    return _enough(found, seeds, deck.name)


def _kept(path, deck, start):
    """The profile of a heap, from the deck's folder where it was poured before."""
    try:
        kept = read_json(path)
    except (OSError, DamagedError):
        kept = None
    if not isinstance(kept, dict) or not kept.keys() <= set(READERS) | {"error"}:
        state = start()[1]
        try:
            own = (state[key] for key in ("position", "radius", "velocity"))
            kept = profile(*own, Rig(deck.spec.geometry).plate_radius)
        except MeasureError as error:
            kept = {"error": str(error)}
        path.parent.mkdir(exist_ok=True)
        write_json(path, kept)
    if "error" in kept:
        raise MeasureError(kept["error"])
    return kept


def heaps_here(deck: Deck, seeds: Sequence[int]) -> list[dict[str, float]]:
    """Profiles of heaps of the calibrated model: those that the deck brings, or as many as `seeds`,
    poured now and kept in the deck's folder."""
    if len(deck.expected["heaps"]) >= FEWEST:
        return list(deck.expected["heaps"])
    mapping, root = deck.spec.model_dump(mode="json"), deck.folder / "heaps"
    specs = named(overlay(mapping, {"seed": seed}) for seed in seeds)
    print(f"pours {len(specs)} heaps of the calibrated model", file=sys.stderr)
    simulate(specs, root)
    return _enough(profiles(specs, RunStore(root)), seeds, "the calibrated model")


def profiles(names: Iterable[str], store: RunStore) -> list[dict[str, float]]:
    """Profiles of those runs that are heaps whose last states are at hand."""
    found = []
    for name in names:
        with suppress(DemError):  # moved here without its state, or no heap
            run = read_run(store.folder(name))
            if plate := plate_of(run.spec):
                found.append(profile(run.position, run.radius, run.velocity, plate))
    return found


def _enough(found, seeds, where):
    """The profiles of heaps, where there are as many as a comparison needs, or all that were
    asked for."""
    if len(found) < min(FEWEST, len(seeds)) and len(seeds) >= FEWEST:
        raise DemError(f"{where}: {len(found)} of {len(seeds)} heaps have a profile")
    return found


def check(folder: str | Path, seeds: int = SEEDS, timeout_s: float = 1e6) -> int:
    """Pour `seeds` heaps of a deck in its code, hold them against the calibrated model's and say
    how they compare; returns 0 where all quantities hold, 1 where one does not."""
    deck = Deck.read(folder)
    own = range(deck.spec.seed, deck.spec.seed + seeds)
    there = heaps_there(deck, own, timeout_s)
    rows = rows_of(deck.spec, deck.expected["margin"], there, heaps_here(deck, own))
    print(_words().checked(deck.name, rows, len(there), READERS), end="")
    return int(any(row["verdict"] != "holds" for row in rows))


RING = 0.5
"""Width of a ring of the envelope, in mean diameters."""
RINGS = 4
"""That make a line."""
FOOT = 0.9
"""Share of the volume on the plate that lies within the foot."""
READERS = {
    "angle_of_repose_deg": "silhouettes",
    "radial_angle_deg": "mean surface",
    "height_mm": "highest grain",
    "on_plate": "grains on the plate",
    "envelope_angle_deg": "envelope",
    "envelope_height_mm": "envelope on the axis",
    "foot_mm": "foot",
}
"""Quantity of a profile -> what it is read from; the last three are the second reader's."""
SCATTER = 2.0
"""Standard deviations of one heap of the calibrated model that make a margin."""


def profile(
    position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, plate_radius: float
) -> dict[str, float]:
    """{quantity of READERS: value} of a heap at rest: angles in degrees, lengths in mm.

    position, velocity (n, 3) [m], [m/s], radius (n,) [m], plate_radius [m]. Raises MeasureError
    where one of the readers finds no heap.
    """
    first = measure_heap(position, radius, velocity, plate_radius)
    axis = np.hypot(position[:, 0], position[:, 1])
    top = position[:, 2] + radius
    heap = (position[:, 2] > 0.0) & (axis < plate_radius) & (1e3 * top <= first["height_mm"])
    angle, height = envelope(axis[heap], top[heap], float(radius.mean()))
    second = {
        "envelope_angle_deg": angle,
        "envelope_height_mm": 1e3 * height,
        "foot_mm": 1e3 * foot(axis[heap], radius[heap]),
    }
    found = first | second
    return {name: float(found[name]) for name in READERS}


def envelope(axis: np.ndarray, top: np.ndarray, radius: float) -> tuple[float, float]:
    """(angle [deg], height on the axis [m]) of the straight line along the highest grain of each
    ring; the innermost, the rounded top, is left out.

    axis, top (n,): distance from the axis and upper end of each grain [m]; radius: mean [m]. Raises
    MeasureError where too few rings hold a grain."""
    ring = (axis / (RING * 2.0 * radius)).astype(int)
    highest = [np.flatnonzero(ring == k)[np.argmax(top[ring == k])] for k in np.unique(ring) if k]
    if len(highest) < RINGS:
        raise MeasureError(f"no heap: grains in {len(highest)} rings about the axis")
    slope, height = np.polyfit(axis[highest], top[highest], 1)
    return float(np.degrees(np.arctan(-slope))), float(height)


def foot(axis: np.ndarray, radius: np.ndarray) -> float:
    """Distance from the axis [m] within which the share FOOT of the grains' volume lies. axis,
    radius (n,) [m]."""
    order = np.argsort(axis)
    held = np.cumsum(radius[order] ** 3)
    return float(axis[order][np.searchsorted(held, FOOT * held[-1])])


def margins_of(
    spec: RunSpec, margin: float, here: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    """{quantity: margin} from the scatter of heaps of the calibrated model; margin: the study's for
    an angle [deg]."""
    grain = 2e3 * mean_radius(spec)
    least = {name: margin for name in READERS if name.endswith("_deg")}
    least |= {"foot_mm": grain, "on_plate": 0.02 * spec.particles.count}
    sd = {name: float(np.std([h[name] for h in here], ddof=1)) for name in READERS}
    return {name: max(least.get(name, 0.5 * grain), SCATTER * sd[name]) for name in READERS}


def rows_of(
    spec: RunSpec,
    margin: float,
    there: Sequence[Mapping[str, float]],
    here: Sequence[Mapping[str, float]],
) -> list[dict[str, Any]]:
    """A row for each quantity of heaps in the target code and here, profiles of heaps of `spec`;
    margin as `margins_of` takes it. verdict: `holds`, `misses`, or `open` where the interval
    reaches beyond the margin; told: a sentence with what differs and what is allowed."""
    rows = []
    for name, allowed in margins_of(spec, margin, here).items():
        c = compare([h[name] for h in there], [h[name] for h in here], allowed)
        low, high, end = c["equivalence_low"], c["equivalence_high"], name.rsplit("_", 1)[-1]
        misses = abs(c["difference"]) > allowed
        row = {
            "quantity": name,
            "unit": end if end in ("deg", "mm") else "",
            "there": c["simulated_mean"],
            "there_sd": c["simulated_sd"],
            "here": c["measured_mean"],
            "here_sd": c["measured_sd"],
            "difference": c["difference"],
            "low": low,
            "high": high,
            "margin": allowed,
            "verdict": "holds" if max(-low, high) < allowed else "misses" if misses else "open",
        }
        rows.append(row | {"told": str(_words().row(row, READERS))})
    return rows


TRIALS = Path(__file__).with_name("trials.json")
ANGLES = ("angle_of_repose_deg", "radial_angle_deg", "envelope_angle_deg")
OWN = "dem"
"""What `trials.json` calls this engine."""


@cache
def trials() -> dict[str, Any]:
    """Content of trials.json: the run spec, what poured the heaps, and {name: trial}: the `changes`
    of its run spec, the conversion of its numbers (`rolling`, null where they are as they are) and
    the profiles {code: [profile, ...]}."""
    return read_json(TRIALS)


def spec_of(name: str) -> RunSpec:
    """`RunSpec` of a trial."""
    kept = trials()
    return parse_spec(overlay(kept["spec"], kept["trials"][name]["changes"]))


def rows_in(code: str, name: str, margin: float) -> list[dict[str, Any]]:
    """A row for each quantity of a trial's heaps in a code and here. margin: of an angle
    [deg]."""
    heaps = trials()["trials"][name]["heaps"]
    return rows_of(spec_of(name), margin, heaps[code], heaps[OWN])


def trial_like(code: str, conversion: Conversion) -> str | None:
    """Name of the trial in a code whose laws and whose conversion are those of a deck; the one of
    equal grains or of several sizes, as the deck's; None where none was made."""
    wanted, several = _laws(conversion.spec, conversion.found), conversion.spec.particles.sizes
    poured = {n: kept for n, kept in trials()["trials"].items() if code in kept["heaps"]}
    specs = {name: spec_of(name) for name in poured}
    found = [n for n in poured if _laws(specs[n], poured[n]["rolling"]) == wanted]
    alike = [n for n in found if bool(specs[n].particles.sizes) == bool(several)]
    return next(iter(alike or found), None)


def _laws(spec, found):
    """Return what decides how a deck's heap compares: rolling law, cohesion, and the law that the
    search chose for other codes."""
    return spec.laws.rolling, spec.laws.cohesion, found["path"] if found else None


def told(code: str, name: str, conversion: Conversion, expected: Mapping[str, Any]) -> str:
    """Sentences for the head of a deck that was not corrected: by how much its angle is off in its
    code, as far as heaps of the same law tell. name: of the code, in words; expected: what the
    calibrated model gives."""
    like, words = trial_like(code, conversion), _words()
    if like is None:
        return words.told(name, conversion, 0, 0, None, [], "")
    heaps = trials()["trials"][like]["heaps"]
    rows = [r for r in rows_in(code, like, expected["margin"]) if r["quantity"] in ANGLES]
    there, here = len(heaps[code]), len(heaps[OWN])
    return words.told(name, conversion, there, here, spec_of(like), rows, expected["metric"])
