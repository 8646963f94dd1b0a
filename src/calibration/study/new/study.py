"""The files of a new study: its configuration, the factors, the measured values, and a page that
tells where each given value went; and its pilot.

In the pilot each rig is run in the middle of the ranges and at their smooth end, where grains come
to rest last, before the settings are handed out. Grains that do not come to rest get more time,
then a shorter time step.
"""

import re
import shutil
import tempfile
import unicodedata
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from calibration.engines.templates import macros
from calibration.errors import CalibrationError
from calibration.files import write_table, write_text
from calibration.study.config import Config, overlay, parse_config, point_spec
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.cost import run_seconds
from calibration.study.factors import COLUMNS, Factor
from calibration.study.new.assumed import ASSUMED
from calibration.study.new.laboratory import CLUMP, Laboratory
from calibration.study.new.methods.declare import refusal, said
from calibration.study.new.methods.heaps import STEEL
from calibration.study.simulated_tests import ratios, simulated
from dem.contact.catalogue import DEFAULTS
from dem.errors import DemError, MeasureError, StoppedError
from dem.spec import parse_spec
from dem.units import behind, unit_of, without_unit

LAWS = {slot: DEFAULTS[slot] for slot in ("rolling", "torsion")}
"""Laws that the file of a new material names: the engine's defaults, so that they are seen."""
MEASURED, GIVEN, PAGE = "measured.csv", "given.csv", "README.md"
_REFUSED = re.compile(r"[^\w\s.,()+/-]|\s\s|^\s|\s$|[\n\t]")


def study_name(folder: str | Path) -> str:
    """Name of a study that begins in a folder: its letters without accents, `_` for the rest.

    Raises CalibrationError for a folder that exists, and for a name that a shell or snakemake would
    take apart.
    """
    name = Path(folder).name
    if not name or _REFUSED.search(name):
        raise refusal("no_folder_name", repr(str(folder)))
    if Path(folder).exists():
        raise CalibrationError(f"{folder}: exists already")
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_") or "study"


def write_factors(path: str | Path, factors: Sequence[Factor]) -> None:
    """Write a factor table, atomically."""
    rows = ["\t".join(str(getattr(f, c)) for c in COLUMNS) for f in factors]
    head = "# low and high: natural levels at -1 and +1; description: where they come from\n"
    write_text(head + "\n".join(["\t".join(COLUMNS), *rows]) + "\n", path)


def write_study(lab: Laboratory, check: Callable[[Config], None] | None = None) -> list[str]:
    """Write the study's files into its new folder and check them; check: a further check of the
    configuration. Returns sentences: what was chosen. Raises CalibrationError, with nothing
    left."""
    folder = lab.folder
    folder.mkdir(parents=True)
    try:
        write_table(_measured(lab.tests), folder / MEASURED)
        write_table(pd.DataFrame(lab.given), folder / GIVEN)
        if lab.grains.spheres:
            columns = ["x_mm", "y_mm", "z_mm", "radius_mm"]
            write_table(pd.DataFrame(lab.grains.spheres, columns=columns), folder / CLUMP)
        write_settings(lab)
        config = parse_config(yaml.safe_load(configuration(lab)), files=[folder / "config.yaml"])
        if check:
            check(config)
    except (CalibrationError, DemError) as error:
        shutil.rmtree(folder)
        # the files it may name are gone
        fault = re.sub(rf"^{re.escape(str(folder))}/[\w.]+(, line \d+)?: ", "", str(error))
        raise CalibrationError(f"what was given makes no study that can run: {fault}") from None
    return lab.said


def write_settings(lab: Laboratory) -> None:
    """Write what atlas and pilot may change: the configuration, the factors and the page."""
    write_factors(lab.folder / "factors.tsv", lab.factors)
    write_text(configuration(lab), lab.folder / "config.yaml")
    write_text(macros("calibration.study.new", "files").page(lab), lab.folder / PAGE)


def _measured(tests):
    columns = ["experiment", "quantity", "value", "unit", "sd", "n"]
    table = pd.DataFrame([row for t in tests for row in t.rows])
    levers = [c for c in table.columns if c not in (*columns, "role", "note")]
    order = [*columns, *levers, *(c for c in ("role", "note") if c in table.columns)]
    table = table.reindex(columns=order)
    return (
        table.astype({"n": "Int64"})
        if table["n"].notna().any()
        else table.drop(columns=["sd", "n"])
    )


def configuration(lab: Laboratory) -> str:
    """The text of the study's config.yaml, in which screening and path are run as often as
    `designs_s` allows, the surface half as often."""
    config = parse_config(yaml.safe_load(_text(lab, 1)))
    seconds = run_seconds(point_spec(config.own_run, config.experiment, {}, config.seed))
    whole = ASSUMED.designs_s
    often = int(whole / (ASSUMED.design_runs * (seconds or whole)))  # once where nothing tells
    return _text(lab, min(max(often, 1), ASSUMED.most_replicates))


def _text(lab, often):
    """The text of config.yaml with designs that are run so often."""
    lead, path = lab.tests[0], lab.folder.as_posix()
    metric = lead.metrics[0]
    parts = {"path": path, "factors": f"{path}/factors.tsv", "measured": f"{path}/{MEASURED}"}
    parts = {name: _yaml(text).splitlines()[0] for name, text in parts.items()}
    sections = {
        "fixed": {f.name: float(f"{f.centre:.4g}") for f in lab.factors},
        "run": _shared_run(lab),
        "tests": {
            t.rig: {"experiment": t.experiment, "metrics": list(t.metrics), "run": t.run}
            | ({"discrepancy": t.discrepancy} if t.discrepancy else {})
            for t in lab.tests
        },
    }
    parts |= {name: _yaml(section, 2) for name, section in sections.items()}
    margin = float(f"{ASSUMED.margin * lead.rows[0]['value']:.3g}")
    margin = ASSUMED.angle_margin_deg if metric == "angle_of_repose_deg" else margin
    return macros("calibration.study.new", "files").config(
        lab.folder.name, lab.name, lab.alone, lead.rig, metric, margin, parts, often
    )


def _yaml(data, indent=0):
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=1000)
    return "".join(f"{' ' * indent}{line}\n" for line in text.splitlines())


def _shared_run(lab):
    """Return what all runs share, with the constants of a law of cohesion in the middle of their
    ranges."""
    grain = {
        "density_kg_m3": lab.grains.density_kg_m3, "shear_modulus_Pa": lab.grains.shear_modulus_Pa
    }  # fmt: skip
    wall = {
        "density_kg_m3": STEEL.density,
        "shear_modulus_Pa": STEEL.shear_modulus,
        "poisson_ratio": STEEL.poisson_ratio,
    }
    laws = dict(LAWS) | ({"cohesion": "jkr"} if lab.grains.sticky else {})
    own = {f.key.removeprefix("law_parameters."): float(f"{f.centre:.4g}") for f in lab.factors
           if f.key.startswith("law_parameters.")}  # fmt: skip
    shared = {"materials": {"particle": grain, "wall": wall}, "laws": laws}
    return shared | ({"law_parameters": own} if own else {})


Show = Callable[[str], object]
MIDDLE, SMOOTH, ROUGH = "the middle of the ranges", "their smooth end", "their rough end"


@dataclass(frozen=True)
class Trial:
    """One run: its metrics {name: value}, why it has no value (empty where it has), and whether its
    grains did not come to rest."""

    metrics: dict[str, Any] = field(default_factory=dict)
    fault: str = ""
    restless: bool = False


def try_study(
    lab: Laboratory, show: Show, estimate: Callable[[Config], str], told: Collection[str] = ()
) -> list[str]:
    """Try a study that is written, change its settings where that is called for, and say what it
    will take. Returns the rigs that gave nothing, whose settings are not good.

    estimate: estimate(config) -> a sentence on the runs of a study and their time; told: rigs of
    which it is known whether the ranges reach what was measured.
    """
    from dem.precompile import compile_engine  # loads the engine

    show("pilot: the engine is compiled first, which takes a minute once")
    compile_engine()
    without = []
    for k, test in enumerate(lab.tests):
        lab, trials = _tried(lab, k, show, test.rig in told)
        for end, trial in trials.items():
            if trial.fault:
                heap = end == MIDDLE and test.experiment == "heap"
                helps = said("helps", trial.fault) if heap else ()
                show("; ".join([f"{test.rig}: no value at {end}: {trial.fault}", *helps]))
        # at an end there may be no heap, and the study knows what to make of that
        gone = trials[MIDDLE].fault or any(t.restless for t in trials.values())
        without += [test.rig] if gone else []
        for sentence in _beside(config_of(lab), test.rig, trials, test.rig in told):
            show(f"{test.rig}: {sentence}")
    for resolution in () if without else ("quick", "full"):
        show(f"{resolution} profile: {estimate(config_of(lab, resolution))}")
    return without


def config_of(lab: Laboratory, resolution: str = "full") -> Config:
    """The configuration of a study that is written, in a profile."""
    data = yaml.safe_load(configuration(lab)) | {"resolution": resolution}
    return parse_config(data, files=[lab.folder / "config.yaml"])


def one_run(data: Mapping[str, Any]) -> Trial:
    """`Trial` of a run spec as a mapping. Raises StoppedError: whoever ends the pilot does not ask
    about this run."""
    from dem.run import run  # loads the engine

    metrics, fault, restless = {}, "", False
    try:
        spec = parse_spec(data)
        with tempfile.TemporaryDirectory() as work:
            metrics = run(spec, Path(work) / "run")["metrics"]
    except StoppedError:
        raise
    except DemError as error:
        fault = str(error)
        late = isinstance(error, MeasureError) and "max_time_s" in fault
        restless = late and getattr(error, "kind", "restless") == "restless"
    if left := metrics.get("in_funnel"):
        fault = f"clogged: {left} grains left in the funnel"
    return Trial(metrics, fault, restless)


def _tried(lab, k, show, told):
    """(`Laboratory`, {end: `Trial`}) of a rig; at the rough end only where nobody told of it and
    the others do not reach what was measured."""
    trials, rig = {}, lab.tests[k].rig
    count = lab.tests[k].run["particles"].get("count", 0)
    resolution = "full" if count <= ASSUMED.few_grains else "quick"
    for end in (MIDDLE, SMOOTH, ROUGH):
        sides = [side for *_, side in _targets(config_of(lab), rig, trials.values())]
        if end == ROUGH and (told or not any(sides)):
            break
        for turn in range(ASSUMED.calmer + 1):
            config = config_of(lab, resolution)
            kind, levels = config.tests[rig].experiment, _levels(config, lab, rig, end)
            trial = one_run(point_spec(config.run_of(rig), kind, levels, config.seed))
            if not trial.restless or turn == ASSUMED.calmer:
                break
            lab = _calmer(lab, k, turn, show)
        trials[end] = trial
        if end == MIDDLE and trial.fault:
            break
    return lab, trials


def _levels(config, lab, rig, end):
    """{key: level} of an end of the ranges in a rig: the rough one has all friction and no
    bounce."""
    by = ratios(config, simulated(config, rig), [f.key for f in lab.factors])
    levels = {f.key: f.centre for f in lab.factors}
    for f in lab.factors if end != MIDDLE else ():
        if f.key.endswith("friction"):
            levels[f.key] = f.high if end == ROUGH else f.low
        elif f.key.endswith("restitution"):
            levels[f.key] = f.low if end == ROUGH else f.high
    return {key: level * by.get(key, 1.0) for key, level in levels.items()}


def _calmer(lab, k, turn, show):
    """The study with more time for the grains of its test k, and from the second turn on shorter
    steps; its files are written."""
    test = lab.tests[k]
    numerics = parse_spec(point_spec(overlay(test.run, {}), test.experiment, {}, 1)).numerics
    more = {"max_time_s": 2.0 * numerics.max_time_s}
    if turn:
        more = {"rayleigh_fraction": round(0.5 * numerics.rayleigh_fraction, 4)}
    key, value = next(iter(more.items()))
    why = f"{test.rig}: {key} is {value:g}, as its grains did not come to rest in the pilot"
    show(why)
    tests = list(lab.tests)
    tests[k] = replace(test, run=overlay(test.run, {"numerics": more}))
    lab = replace(lab, tests=tests, said=[*lab.said, why])
    write_settings(lab)
    return lab


def _targets(config, rig, trials):
    """(metric, measured mean, side) of each target of a rig; side: 1 where what was measured lies
    above all that runs gave, -1 below, 0 between, by its standard error."""
    for target in (t for t in joint_targets(config) if t.test == rig):
        found = read_joint_target(config, target)
        mean, error = found.mean, float(np.sqrt(found.variance))
        given = [t.metrics[target.metric] for t in trials if target.metric in t.metrics] or [mean]
        yield target.metric, mean, int(mean > max(given) + error) - int(mean < min(given) - error)


def reach(config: Config, rig: str, metric: str, side: int) -> str:
    """Return what is said of ranges that reach a measured value (`side` 0), or of which all lies
    below it (1) or above (-1)."""
    plain = not {"elongation", "clump"} & set(config.own_run["particles"])
    heap = config.tests[rig].experiment == "heap"
    return ". ".join(said("reach", side, metric == "angle_of_repose_deg", plain, heap))


def _beside(config, rig, trials, told):
    """Sentences: what a rig gave beside each of its targets, and where nobody told, whether the
    ranges reach it."""
    for metric, mean, side in _targets(config, rig, trials.values()):
        unit, name = behind(unit_of(metric)), without_unit(metric).replace("_", " ")
        given = [f"{t.metrics[metric]:.4g}{unit} at {end}" for end, t in trials.items()
                 if metric in t.metrics]  # fmt: skip
        judged = "" if told else f": {reach(config, rig, metric, side)}"
        if given:
            yield f"{name} {', '.join(given)}; measured {mean:.4g}{unit}{judged}"
