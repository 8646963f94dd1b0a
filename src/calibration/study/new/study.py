"""The files of a new study: a configuration of one page, the factors and the measured values."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import yaml

from calibration.errors import CalibrationError
from calibration.files import write_table, write_text
from calibration.intake.measurements import readings_table
from calibration.intake.quantities import quantity_name
from calibration.intake.tables import summary
from calibration.study.config import parse_config
from calibration.study.config.schema import COARSER
from calibration.study.factors import COLUMNS
from calibration.study.new.heap import MOST, STEEL, roomy_height
from dem.contact.catalogue import DEFAULTS
from dem.errors import DemError
from dem.experiments import experiments
from dem.experiments.heap import PACKING
from dem.flow import FREE_FLOW_RATIO

if TYPE_CHECKING:
    from calibration.study.factors import Factor
    from calibration.study.new.heap import Heap


LAWS = {slot: DEFAULTS[slot] for slot in ("rolling", "torsion")}
"""Laws that the file of a new material names: the engine's defaults, so that they are seen."""
MEASURED = "measured.csv"
PACKED = "poured_density_kg_m3"  # metric of the second experiment
ENOUGH = 1000  # grains of a heap; 600 of sand scattered by 2.3 deg, 2,500 by 0.9
CLOGS = 3.0  # grains across an orifice that none pass for long
ACROSS = 10.0  # largest grains across the vessel of a bulk density
LEAST_ACROSS = 6.0  # of a sieve curve, whose small grains are many
DEEP = 0.9  # of the vessel's width is filled
_REFUSED = re.compile(r"[^\w\s.,()+/-]|\s\s|^\s|\s$|[\n\t]")


def study_name(folder: str | Path) -> str:
    """Name of a folder's study: its letters without accents, `_` for the rest.

    Raises CalibrationError for a name that a shell or snakemake would take apart.
    """
    name = Path(folder).name
    if not name or _REFUSED.search(name):
        raise CalibrationError(
            f"{str(folder)!r}: cannot be a study's folder; allowed: letters, digits, single spaces "
            "and . , ( ) + - _"
        )
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_") or "study"


def check_folder(folder: str | Path) -> str:
    """Name of a study that could begin in `folder`. Raises CalibrationError where none could."""
    name = study_name(folder)
    if Path(folder).exists():
        raise CalibrationError(f"{folder}: exists already")
    return name


def write_study(
    folder: str | Path,
    values: Sequence[float],
    heap: Heap,
    factors: Sequence[Factor],
    sizes: Mapping[str, Any] | None = None,
    bulk: Sequence[float] = (),
    most: int = MOST,
) -> list[str]:
    """Write config.yaml, factors.tsv and measured.csv into a new folder and check them.

    values (n,): measured angles [deg]; heap: `Heap` of the laboratory; sizes: `particles.sizes` of
    a sieve curve; bulk (m,): poured bulk densities [kg/m3], which the calibrated grains are tried
    on; most: grains that are simulated at most. Returns sentences: what was chosen. Raises
    CalibrationError, with nothing left.
    """
    folder, name = Path(folder), check_folder(folder)
    if heap.orifice_diameter_mm < CLOGS * heap.diameter_mm:
        raise CalibrationError(
            f"orifice_diameter_mm {heap.orifice_diameter_mm:g}: any funnel clogs; allowed: at "
            f"least "
            f"{CLOGS:g} times the largest grain ({heap.diameter_mm:g} mm)"
        )
    simulated = heap if sizes else heap.of_at_most(most)
    second = packing(heap, sizes) if bulk else None
    text = _configuration(folder, name, simulated, factors, sizes, second)
    folder.mkdir(parents=True)
    try:
        angles = readings_table("heap", "angle_of_repose", [f"{v:g}" for v in values], "deg")
        packed = readings_table(
            _experiment_of(PACKED), quantity_name(PACKED), [f"{v:g}" for v in bulk], "kg/m3"
        )
        write_table(pd.concat([angles, packed]) if bulk else angles, folder / MEASURED)
        write_factors(folder / "factors.tsv", factors)
        write_text(text, folder / "config.yaml")
        parse_config(yaml.safe_load(text), files=[folder / "config.yaml"])
    except (CalibrationError, DemError):
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()
        raise
    return [*_choices(heap, simulated), *_tried_on(bulk)]


def _experiment_of(metric):
    return next(name for name, e in experiments().items() if metric in e.targets)


def packing(heap: Heap, sizes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Section of `push_through` (a mapping) that pours the laboratory's own grains into a vessel:
    what they pack to follows from no angle of repose."""
    largest = max(sizes["diameters_mm"]) if sizes else heap.diameter_mm
    wide = ACROSS if sizes is None else LEAST_ACROSS
    bed = math.pi / 4 * wide**2 * DEEP * wide * largest**3
    count = round(PACKING * bed / (math.pi / 6 * heap.diameter_mm**3))
    grain = {"sizes": sizes} if sizes else {"diameter_mm": heap.diameter_mm}
    return {
        "experiment": _experiment_of(PACKED),
        "metrics": [PACKED],
        "draws": 6,
        "run": {
            "particles": {"count": count} | grain,
            "geometry": {"vessel_diameter_mm": round(wide * largest, 4), "taps": 0},
        },
    }


def _tried_on(bulk):
    if not bulk:
        return []
    return [
        f"second experiment: {summary(bulk, ' kg/m³')}; the calibrated grains are poured into a "
        "vessel at the end, and the report says what they pack to beside it (push_through)"
    ]


def write_factors(path: str | Path, factors: Sequence[Factor]) -> None:
    """Write a factor table, atomically."""
    rows = ["\t".join(str(getattr(f, c)) for c in COLUMNS) for f in factors]
    head = "# low and high: natural levels at -1 and +1; description: where they come from\n"
    write_text(head + "\n".join(["\t".join(COLUMNS), *rows]) + "\n", path)


def _choices(heap, simulated):
    found = [
        f"{simulated.count:,} grains of {simulated.diameter_mm:.3g} mm cover the plate; the funnel "
        f"is fed {simulated.feed_per_s:,.0f} a second, {simulated.feed_share:.0%} of what its "
        f"orifice passes (Beverloo 1961), for {simulated.pouring_s:.1f} s"
    ]
    if simulated.diameter_mm > heap.diameter_mm:
        ratio = simulated.diameter_mm / heap.diameter_mm
        found.append(
            f"they are {ratio:.2f} times as large as yours, of the same volume together: "
            f"{heap.count:,} "
            "are more than are simulated at most (--grains; run.particles in config.yaml)"
        )
    quick = COARSER["quick"]
    if simulated.count < quick * ENOUGH <= heap.count:
        found.append(
            f"warning: the quick profile pours {simulated.count / quick:.0f} grains, whose heaps "
            f"scatter by degrees; --grains {quick * ENOUGH:.0f} gives it {ENOUGH}"
        )
    roomy = roomy_height(heap.plate_diameter_mm, heap.plate_rim_height_mm, heap.angle_deg)
    if heap.discharge_height_mm < roomy:
        found.append(
            f"warning: heaps little steeper than yours touch the orifice and are cut off; at "
            f"{roomy} mm (--height) they would not be"
        )
    across = heap.orifice_diameter_mm / heap.diameter_mm
    if across < FREE_FLOW_RATIO:
        wider = FREE_FLOW_RATIO * heap.diameter_mm
        found.append(
            f"warning: the orifice is {across:.1f} grains wide and may clog; {wider:.3g} mm would "
            f"not, "
            "nor would a lifted cylinder"
        )
    return found


def _fed(heap):
    share = f"{heap.feed_share:.0%} of what the orifice passes"
    if heap.mass_flow_g_s is None:
        return f"{share}; not measured"
    return f"{heap.mass_flow_g_s:g} g/s as given, {share}"


def _configuration(folder, name, heap, factors, sizes, second=None):
    quoted = lambda path: yaml.safe_dump(  # noqa: E731
        Path(path).as_posix(), allow_unicode=True, width=1000
    ).splitlines()[0]
    fixed = "".join(f"  {f.name}: {f.centre:.4g}\n" for f in factors)
    grain = (
        f"sizes: {yaml.safe_dump(sizes, default_flow_style=True, width=1000).strip()}"
        if sizes
        else f"diameter_mm: {heap.diameter_mm:g}"
    )
    mouth = max(heap.plate_diameter_mm, 2 * heap.orifice_diameter_mm)
    supplements = "posterior, push_through" if second else "posterior"
    rim = (
        f"    plate_rim_height_mm: {heap.plate_rim_height_mm:g}\n"
        if heap.plate_rim_height_mm
        else ""
    )
    return f"""\
# A study of {folder.name}. From the folder that {quoted(folder)} lies in:
#   calibration run {quoted(folder)} -n       what it would do
#   calibration run {quoted(folder)}          all of it, and results/{name}/report.html
#   --config resolution=quick beside it: a quarter of the grains, for a first look
# config/REFERENCE.md explains every part.
name: {name}
factors: {quoted(folder / "factors.tsv")}
supplements: [{supplements}] # the report waits for it: the parameters as a distribution

measurements: {quoted(folder / MEASURED)} # all that was measured
target: {{ metric: angle_of_repose_deg }}

fixed: # a factor's level while it is not varied: the middle of its range
{fixed}
run: # what all heaps share
  materials:
    particle:
      density_kg_m3: {heap.density_kg_m3:g} # of the grain, not of the bed
      shear_modulus_Pa: {heap.shear_modulus_Pa:.1e} # softened, for longer time steps
    # steel, assumed
    wall: {{ {_wall()} }}
  # on the relative spin: they hold in motion too
  laws: {{ rolling: {LAWS["rolling"]}, torsion: {LAWS["torsion"]} }}
  particles: {{ count: {heap.count}, {grain} }}
  geometry:
    orifice_diameter_mm: {heap.orifice_diameter_mm:g}
    plate_diameter_mm: {heap.plate_diameter_mm:g}
    discharge_height_mm: {heap.discharge_height_mm:g}
{rim}    funnel_top_diameter_mm: {mouth:g} # assumed
    generation_rate_per_s: {heap.feed_per_s:.0f} # {_fed(heap)}
  numerics:
    max_time_s: {max(12.0, 2 * heap.pouring_s + 5):.3g}
    rayleigh_fraction: {heap.rayleigh_fraction:g} # impacts last, pressed grains come to rest

screening: {{ at_least: 3, at_most: 3 }}
ascent: {{ rule: effects, steps: 5 }}
# margin: a difference in degrees that does not matter
validation: {{ groups: 2, replicates: 5, margin: 1.0 }}
{_second(second)}"""


def _wall():
    rho, modulus, poisson = STEEL.density, STEEL.shear_modulus, STEEL.poisson_ratio
    return f"density_kg_m3: {rho:g}, shear_modulus_Pa: {modulus:.1e}, poisson_ratio: {poisson:g}"


def _second(machine):
    """The lines of the second experiment; nothing where none was measured."""
    if not machine:
        return ""
    run = {k: yaml.safe_dump(v, default_flow_style=True, width=1000).strip()
           for k, v in machine["run"].items()}  # fmt: skip
    return f"""\
push_through: # the calibrated grains in a second experiment, beside what was measured of it
  bulk:
    experiment: {machine["experiment"]}
    metrics: [{", ".join(machine["metrics"])}]
    draws: {machine["draws"]} # of the parameters that the angle leaves open
    run:
      particles: {run["particles"]}
      geometry: {run["geometry"]}
"""
