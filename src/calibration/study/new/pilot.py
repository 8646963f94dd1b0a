"""The pilot of a new study: each rig is run in the middle of the ranges and at their smooth end,
where grains come to rest last, before the settings are handed out. Grains that do not come to rest
get more time, then a shorter time step."""

import tempfile
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from calibration.study.config import Config, overlay, parse_config, point_spec
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.new.laboratory import Laboratory
from calibration.study.new.methods.declare import said
from calibration.study.new.study import configuration, write_settings
from calibration.study.simulated_tests import ratios, simulated
from dem.errors import DemError, MeasureError, StoppedError
from dem.spec import parse_spec
from dem.units import behind, unit_of, without_unit

Show = Callable[[str], object]
EVERY_S = 5.0  # a run that goes on is told of
CALMER = 2  # times that a rig's settings are changed so that its grains come to rest
FEW = 2000  # grains of a heap that takes seconds as it is; above, the quick profile's are poured
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
    with heard("compiling", show):
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


@contextmanager
def heard(what: str, show: Show) -> Iterator[None]:
    """A block that is told of every few seconds while it lasts."""
    over, begun = threading.Event(), time.monotonic()

    def tell():
        with suppress(BrokenPipeError):  # nobody reads on, which the block itself finds
            while not over.wait(EVERY_S):
                show(f"{what}: {time.monotonic() - begun:.0f} s so far")

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def config_of(lab: Laboratory, resolution: str = "full") -> Config:
    """The configuration of a study that is written, in a profile."""
    data = yaml.safe_load(configuration(lab)) | {"resolution": resolution}
    return parse_config(data, files=[lab.folder / "config.yaml"])


def one_run(config: Config, run_spec: dict, experiment: str, levels: dict) -> Trial:
    """`Trial` of a run spec at levels {key: level}. Raises StoppedError: whoever ends the pilot
    does not ask about this run."""
    from dem.run import run  # loads the engine

    metrics, fault, restless = {}, "", False
    try:
        spec = parse_spec(point_spec(run_spec, experiment, levels, config.seed))
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
    resolution = "full" if count <= FEW else "quick"
    for end in (MIDDLE, SMOOTH, ROUGH):
        sides = [side for *_, side in _targets(config_of(lab), rig, trials.values())]
        if end == ROUGH and (told or not any(sides)):
            break
        for turn in range(CALMER + 1):
            config = config_of(lab, resolution)
            kind, levels = config.tests[rig].experiment, _levels(config, lab, rig, end)
            with heard(f"{rig} at {end}", show):
                trial = one_run(config, config.run_of(rig), kind, levels)
            if not trial.restless or turn == CALMER:
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
    for target in (t for t in joint_targets(config) if t.tests == (rig,)):
        found = read_joint_target(config, target)
        mean, error = float(found.mean[0]), float(np.sqrt(found.covariance[0, 0]))
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
