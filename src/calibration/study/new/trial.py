"""The pilot of a study on disk: coarse heaps, then narrower ranges in its factor table; of a joint
study a run of each rig."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import yaml

from calibration.intake.quantities import quantity_name
from calibration.study.config import machine_run, parse_config, point_spec, read_target
from calibration.study.config.joint import read_joint_target
from calibration.study.factors import read_factors
from calibration.study.new.pilot import advice, corners, cost, pilot, shrunk
from calibration.study.new.reach import reach
from calibration.study.new.study import write_factors
from calibration.study.stages import expected_runs
from calibration.study.stages.joint import runs_of
from dem.errors import DemError, StoppedError
from dem.spec import parse_spec
from dem.units import behind, unit_of


def try_study(folder: str | Path, show: Callable[[str], object] = print) -> None:
    """Pour a coarse heap at each point of the screening, move the ends of the ranges in to where
    all stand, and say what the study will take."""
    path = Path(folder) / "config.yaml"
    config = parse_config(yaml.safe_load(path.read_text("utf-8")), files=[path])
    show("pilot: the engine is compiled first, which takes a minute once")
    factors = read_factors(config.factors)

    def pour(ranges, points):
        return pilot(config, ranges, points, show)

    def again(ranges, points):
        show(f"{len(points)} do not stand: they are poured again with narrower ranges")
        return pour(ranges, points)

    cut, trials = shrunk(factors, pour(factors, corners(config, factors)), again)
    for old, new in zip(factors, cut, strict=True):
        if old != new:
            show(f"{new.name}: {old.low:g} to {old.high:g} becomes {new.low:g} to {new.high:g}")
    write_factors(config.factors, cut)
    measured = read_target(config).mean()
    for sentence in advice(trials, measured):
        show(sentence)
    for sentence in reach(config, cut, trials, measured, show):
        show(sentence)
    if said := cost(config, trials):
        show(said)


def try_rigs(folder: str | Path, show: Callable[[str], object] = print) -> None:
    """Run each rig of a joint study once, in the quick profile and in the middle of the ranges, and
    say what it gives beside what was measured, or why it gives nothing, and what the stage will
    take."""
    from dem.warm import compile_engine  # loads the engine

    path = Path(folder) / "config.yaml"
    data = yaml.safe_load(path.read_text("utf-8")) | {"resolution": "quick"}
    config = parse_config(data, files=[path])
    show("pilot, in the quick profile: the engine is compiled first, which takes a minute once")
    compile_engine()  # else the first rig's time would hold it, and the estimate a multiple of it
    factors = read_factors(config.factors)
    lasted = {}
    for rig in config.rigs:
        words, lasted[rig] = _one_run(config, factors, rig)
        show(f"{rig}: {words} ({lasted[rig]:.0f} s)")
    runs = {rig: runs_of(config, rig) for rig in lasted}
    joint = sum(seconds * runs[rig] for rig, seconds in lasted.items())
    # the first rig is the study's own
    chain = (expected_runs(config) - sum(runs.values())) * next(iter(lasted.values()))
    show(
        f"on two cores in the quick profile: the stage joint about {_duration(joint / 2)}, with "
        f"the chain, the report and the exports about {_duration((joint + chain) / 2)}"
    )


def _one_run(config, factors, rig):
    """(what a rig gives in words, seconds of a processor that it took: other programs that run
    beside the pilot do not count)."""
    from dem.run import run  # loads the engine

    own = config.rigs[rig]
    levels = {f.key: f.centre for f in factors}
    targets = [t for t in config.targets if t.rig == rig]
    begun = time.process_time()
    try:
        spec = parse_spec(point_spec(machine_run(config, own), own.experiment, levels, config.seed))
        with tempfile.TemporaryDirectory() as work:
            found = run(spec, Path(work) / "run")["metrics"]
    except StoppedError:
        raise
    except DemError as error:
        return f"no value in the middle of the ranges: {error}", time.process_time() - begun
    told = [_beside(config, t, found) for t in targets]
    return ", ".join(told) or "runs; no target", time.process_time() - begun


def _beside(config, target, found):
    measured = float(read_joint_target(config, target).mean[0])
    unit = behind(unit_of(target.metric))
    name = quantity_name(target.metric).replace("_", " ")
    return f"{name} {found[target.metric]:.4g}{unit}, measured {measured:.4g}{unit}"


def _duration(seconds):
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
