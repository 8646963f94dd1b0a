"""The pilot of a study on disk: coarse heaps, then narrower ranges in its factor table; of a joint
study a run of each rig."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import yaml

from calibration.intake.quantities import quantity_name
from calibration.study.config import (
    Config,
    machine_run,
    overlay,
    parse_config,
    point_spec,
    read_target,
)
from calibration.study.config.joint import read_joint_target
from calibration.study.config.schema import COARSER
from calibration.study.cost import LEAST_JOBS, START_S, duration, run_seconds
from calibration.study.factors import read_factors
from calibration.study.new.pilot import advice, corners, cost, pilot, shrunk
from calibration.study.new.reach import FRICTION, are_spheres, reach
from calibration.study.new.sticking import eased, sticking, write_eased
from calibration.study.new.study import write_factors
from calibration.study.parcels import ratios
from calibration.study.stages import expected_runs, expecting, load_stages
from calibration.study.stages.joint import runs_of
from dem.errors import DemError, StoppedError
from dem.spec import parse_spec
from dem.units import behind, unit_of

ANGLE = "angle_of_repose_deg"
LONG_S = 2 * 1800.0
"""Of a core, half an hour of two: the pilot says from there on what would be shorter."""


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


def try_rigs(folder: str | Path, show: Callable[[str], object] = print) -> list[str]:
    """Run each rig of a joint study once, in the quick profile and in the middle of the ranges, and
    say what it gives beside what was measured, or why it gives nothing, and what the stage will
    take. Returns the rigs that gave nothing; what these take is not known."""
    from dem.warm import compile_engine  # loads the engine

    path = Path(folder) / "config.yaml"
    data = yaml.safe_load(path.read_text("utf-8")) | {"resolution": "quick"}
    config = parse_config(data, files=[path])
    show("pilot, in the quick profile: the engine is compiled first, which takes a minute once")
    compile_engine()  # else the first rig's time would hold it, and the estimate a multiple of it
    factors = read_factors(config.factors)
    if _ease(folder, config, factors, show):
        data = yaml.safe_load(path.read_text("utf-8")) | {"resolution": "quick"}
        config = parse_config(data, files=[path])
        factors = read_factors(config.factors)
    lasted, without = {}, []
    for rig in config.rigs:
        found, fault, lasted[rig] = _one_run(config, rig, _middle(config, factors, rig))
        told = fault and f"no value in the middle of the ranges: {fault}"
        told = told or _beside(config, rig, found) or "runs; no target"
        show(f"{rig}: {told} ({lasted[rig]:.0f} s)")
        without += [rig] if fault else []
        if sentence := _at_its_steepest(config, factors, rig, found):
            show(f"{rig}: {sentence}")
    if without:
        return without
    own = next(iter(lasted))  # the first rig is the study's own
    for where, seconds in (
        ("in the quick profile", lasted),
        ("in full", lasted | {own: lasted[own] * _finer(path, config)}),
    ):
        joint, chain = _cost(config, seconds, own)
        show(
            f"{where}, on two cores: the stage joint about {duration(joint / 2)}, with the chain, "
            f"the report and the exports about {duration((joint + chain) / 2)}"
        )
    if sum(_cost(config, lasted, own)) > LONG_S:
        for sentence in shorter(config, own):
            show(sentence)
    return without


def _cost(config, seconds, own):
    """(seconds of a core of the stage joint, those of the chain) by the seconds of a run of each
    rig."""
    runs = {rig: runs_of(config, rig) for rig in seconds}
    joint = sum(seconds[rig] * n for rig, n in runs.items())
    chain = (expected_runs(config) - sum(runs.values())) * seconds[own]
    of_joint = len(load_stages()["joint"].plans)
    starts = LEAST_JOBS * START_S  # of a plan
    return joint + of_joint * starts, chain + (len(expecting()) - of_joint) * starts


def _finer(path, quick):
    """How many times as long a run of the study's own rig takes with all of its grains; by the
    count and the time step of grains where nothing tells what a run takes."""
    full = parse_config(yaml.safe_load(path.read_text("utf-8")), files=[path])
    seconds = [run_seconds(point_spec(c.run, c.experiment, {}, c.seed)) for c in (quick, full)]
    less, more = seconds[0], seconds[1]
    return more / less if less and more else COARSER["quick"] ** (4 / 3)


def shorter(config: Config, rig: str) -> list[str]:
    """Sentences: what makes the runs of a rig long, and what of it the user can change; none where
    nothing tells what a run takes."""
    run = machine_run(config, config.rigs[rig])
    spec = point_spec(run, config.rigs[rig].experiment, {}, config.seed)
    whole = run_seconds(spec)
    if not whole:
        return []
    changed = {}
    if "clump" in run["particles"]:
        sphere = {k: v for k, v in run["particles"].items() if k != "clump"}
        words = "spheres of the same volume (--grain in place of --axes)"
        changed[words] = spec | {"particles": sphere}
    if "lift_speed_mm_s" in run.get("geometry", {}):
        twice = 2.0 * run["geometry"]["lift_speed_mm_s"]
        words = f"a cylinder that is lifted at {twice:g} mm/s, if yours was as fast (speed=)"
        changed[words] = overlay(spec, {"geometry": {"lift_speed_mm_s": twice}})
    shares = {w: (run_seconds(other) or whole) / whole for w, other in changed.items()}
    ways = [f"{words}: {share:.0%} of it" for words, share in shares.items()]
    return [f"the runs of {rig} make it long. Shorter: {'; '.join(ways)}"] if ways else []


def _ease(folder, config, factors, show):
    """Move in the upper end of how much grains stick where no heap forms there; whether it did."""
    sticky = sticking(config, factors)
    if not sticky:
        return False

    def fault(levels):
        return _try(config.run, config.experiment, levels, config.seed)[1]

    found, why = eased(factors, sticky, fault)
    for old, new in zip(factors, found, strict=True):
        if new != old:
            show(
                f"{new.name}: {old.low:g} to {old.high:g} becomes {new.low:g} to {new.high:g}, as "
                f"at the old end no heap forms where grains are rough ({why})"
            )
    if changed := found != list(factors):
        write_eased(folder, config.factors, found)
    return changed


def _middle(config, factors, rig):
    """{key: level} of the middle of the ranges in a rig."""
    by = ratios(config, rig, [f.key for f in factors])
    return {f.key: f.centre * by.get(f.key, 1.0) for f in factors}


def _one_run(config, rig, levels):
    """(metrics of a rig at levels {key: level}, why there are none, seconds of a processor that it
    took: other programs that run beside the pilot do not count)."""
    own = config.rigs[rig]
    begun = time.process_time()
    found, fault = _try(machine_run(config, own), own.experiment, levels, config.seed)
    return found, fault, time.process_time() - begun


def _at_its_steepest(config, factors, rig, middle):
    """A sentence on a rig's heap at the ends of the ranges that steepen it, where the one in the
    middle, of these metrics, is flatter than the measured; None where it is not."""
    target = next((t for t in config.targets if (t.rig, t.metric) == (rig, ANGLE)), None)
    if target is None or ANGLE not in middle:
        return None
    measured = float(read_joint_target(config, target).mean[0])
    if middle[ANGLE] >= measured:
        return None
    levels = _middle(config, factors, rig)
    levels |= {f.key: f.high for f in factors if f.key.endswith(FRICTION)}
    levels |= {f.key: f.low for f in factors if f.key.endswith("restitution")}
    steepest = _one_run(config, rig, levels)[0].get(ANGLE)
    if steepest is None:
        return None
    told = f"at the ends that steepen it {steepest:.4g}°"
    if steepest >= measured:
        return f"{told}: the ranges reach yours"
    said = f"{told}, {measured - steepest:.1f}° flatter than yours: these ranges may not reach it"
    if are_spheres(config.run["particles"]):
        said += ". Longer grains stand steeper (--axes, or particles.elongation)"
    return said


def _try(run_spec, experiment, levels, seed):
    """(metrics, why there are none, empty where there are) of a run at levels {key: level}."""
    from dem.run import run  # loads the engine

    try:
        spec = parse_spec(point_spec(run_spec, experiment, levels, seed))
        with tempfile.TemporaryDirectory() as work:
            return run(spec, Path(work) / "run")["metrics"], ""
    except StoppedError:
        raise
    except DemError as error:
        return {}, str(error)


def _beside(config, rig, found):
    """What a rig gave beside its targets, in words; empty without a target."""
    return ", ".join(_one_beside(config, t, found) for t in config.targets if t.rig == rig)


def _one_beside(config, target, found):
    measured = float(read_joint_target(config, target).mean[0])
    unit = behind(unit_of(target.metric))
    name = quantity_name(target.metric).replace("_", " ")
    return f"{name} {found[target.metric]:.4g}{unit}, measured {measured:.4g}{unit}"
