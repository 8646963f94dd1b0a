"""The pilot of a new study: its settings are tried before they are handed out, and what the runs
give is held against what was measured.

Of a heap alone a coarse one is poured at each point of the screening, and the ends of the ranges
move in to where all stand. Of several tests each rig is run in the middle of the ranges and at
their smooth end, where grains come to rest last, and at the rough one where these two do not reach
the measured value. Grains that do not come to rest get more time, then a shorter time step.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from calibration.statistics.screening_design import screening_design
from calibration.study.config import overlay, parse_config, point_spec
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.new.study import configuration, write_settings
from calibration.study.simulated_tests import WITH_SIZE, ratios, simulated
from dem.errors import DemError, MeasureError, StoppedError
from dem.spec import parse_spec
from dem.units import behind, unit_of, without_unit

if TYPE_CHECKING:
    from calibration.study.config import Config
    from calibration.study.factors import Factor
    from calibration.study.new.laboratory import Laboratory

Show = Callable[[str], object]
ANGLE = "angle_of_repose_deg"
EVERY_S = 5.0  # a run that goes on is told of
CALMER = 2  # times that a rig's settings are changed so that its grains come to rest
COARSE = 1250  # grains
WIDE_ENOUGH = 5.0  # grains across the orifice
ROUNDS = 2  # of moving ends of ranges
MOVE = 0.2  # of a range, by which an end moves in a round
MOST = 0.4  # of a range, that an end moves in all rounds: the middle stays inside
FURTHER = 2  # rounds more where over a quarter of the heaps still does not stand
TELLING = 0.25  # more of the heaps at an end than at the other do not stand, where it moves then
HALVINGS = 5  # of the upper end of how much grains stick


@dataclass(frozen=True)
class Trial:
    """One run: its point of the ranges' unit cube, its metrics {name: value}, why it has no value
    (empty where it has), the time [s] of a processor that it took, and whether its grains did not
    come to rest."""

    point: tuple
    metrics: dict[str, Any] = field(default_factory=dict)
    fault: str = ""
    seconds: float = 0.0
    restless: bool = False

    @property
    def angle_deg(self) -> float | None:
        """Angle of repose, None where there is none."""
        return self.metrics.get(ANGLE)

    @property
    def found(self) -> str:
        """The angle, or why there is none, in words."""
        return self.fault or f"{self.angle_deg:.1f}°"


def try_study(lab: Laboratory, show: Show, estimate: Callable[[Config], str]) -> list[str]:
    """Try a study that is written, change its files where that is called for, and say what it will
    take. Returns the rigs that gave nothing, whose settings are not good.

    estimate: estimate(config) -> a sentence on the runs of a study and their time.
    """
    from dem.precompile import compile_engine  # loads the engine

    show("pilot: the engine is compiled first, which takes a minute once")
    with heard("compiling", show):
        compile_engine()
    lab, without = _of_one_heap(lab, show) if lab.alone else _of_rigs(lab, show)
    for resolution in () if without else ("quick", "full"):
        show(f"{resolution} profile: {estimate(_config(lab, resolution))}")
    return without


@contextmanager
def heard(what: str, show: Show) -> Iterator[None]:
    """A block that is told of every few seconds while it lasts."""
    over, begun = threading.Event(), time.monotonic()

    def tell():
        while not over.wait(EVERY_S):
            show(f"{what}: {time.monotonic() - begun:.0f} s so far")

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _config(lab, resolution):
    data = yaml.safe_load(configuration(lab)) | {"resolution": resolution}
    return parse_config(data, files=[lab.folder / "config.yaml"])


def one_run(
    config: Config, run_spec: dict, experiment: str, levels: dict, point: tuple = ()
) -> Trial:
    """`Trial` of a run spec at levels {key: level}. Raises StoppedError: whoever ends the pilot
    does not ask about this run."""
    from dem.run import run  # loads the engine

    begun = time.process_time()  # other programs that run beside the pilot do not count
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
    return Trial(point, metrics, fault, time.process_time() - begun, restless)


def _calmer(lab, k, turn, show):
    """The study with more time for the grains of its test k, and from the second turn on shorter
    steps; its files are written."""
    test = lab.tests[k]
    run = overlay(test.run, {})
    numerics = parse_spec(point_spec(run, test.experiment, {}, 1)).numerics
    more = {"max_time_s": 2.0 * numerics.max_time_s}
    if turn:
        more = {"rayleigh_fraction": round(0.5 * numerics.rayleigh_fraction, 4)}
    key, value = next(iter(more.items()))
    said = f"{test.rig}: {key} is {value:g}, as its grains did not come to rest in the pilot"
    show(said)
    tests = [
        *lab.tests[:k],
        replace(test, run=overlay(run, {"numerics": more})),
        *lab.tests[k + 1 :],
    ]
    lab = replace(lab, tests=tests, said=[*lab.said, said])
    write_settings(lab)
    return lab


def _with_factors(lab, factors, show):
    """The study with other ranges, which are told; its files are written."""
    for old, new in zip(lab.factors, factors, strict=True):
        if old != new:
            show(f"{new.name}: {old.low:g} to {old.high:g} becomes {new.low:g} to {new.high:g}")
    lab = replace(lab, factors=list(factors))
    write_settings(lab)
    return lab


# --- several tests


def _of_rigs(lab, show):
    """(`Laboratory`, rigs that gave nothing) after each rig was run at the ends of the ranges."""
    lab, without = _eased(lab, show), []
    for k, test in enumerate(lab.tests):
        lab, trials = _tried(lab, k, show)
        for end, trial in trials.items():
            if trial.fault:
                show(f"{test.rig}: no value at {end}: {trial.fault}")
        # at an end there may be no heap, and the study knows what to make of that
        gone = trials[MIDDLE].fault or any(t.restless for t in trials.values())
        without += [test.rig] if gone else []
        for sentence in _beside(_config(lab, "quick"), test.rig, trials):
            show(f"{test.rig}: {sentence}")
    return lab, without


MIDDLE, SMOOTH, ROUGH = "the middle of the ranges", "their smooth end", "their rough end"


def _tried(lab, k, show):
    """(`Laboratory`, {end: `Trial`}) of a rig; at the rough end only where the others do not reach
    what was measured."""
    trials = {}
    for end in (MIDDLE, SMOOTH, ROUGH):
        rig = lab.tests[k].rig
        if end == ROUGH and not _missed(_config(lab, "quick"), rig, trials):
            break
        for turn in range(CALMER + 1):
            config = _config(lab, "quick")
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


def _missed(config, rig, trials):
    """Metrics of a rig's targets that its runs do not reach."""
    targets = [t for t in joint_targets(config) if t.tests == (rig,)]
    return [t.metric for t in targets if not _reached(*_measured(config, t), trials, t.metric)]


def _measured(config, target):
    """(measured mean, its standard error) of a target."""
    found = read_joint_target(config, target)
    return float(found.mean[0]), float(np.sqrt(found.covariance[0, 0]))


def _reached(mean, error, trials, metric):
    values = [t.metrics[metric] for t in trials.values() if metric in t.metrics]
    return bool(values) and min(values) - error <= mean <= max(values) + error


def _beside(config, rig, trials):
    """Sentences: what a rig gave beside each of its targets, and whether the ranges reach it."""
    for target in (t for t in joint_targets(config) if t.tests == (rig,)):
        metric, unit = target.metric, behind(unit_of(target.metric))
        mean, error = _measured(config, target)
        told = [f"{t.metrics[metric]:.4g}{unit} at {end}" for end, t in trials.items()
                if metric in t.metrics]  # fmt: skip
        if not told:
            continue
        judged = "the ranges reach it"
        if not _reached(mean, error, trials, metric):
            judged = "these ranges may not reach it"
            if metric == ANGLE and not {"elongation", "clump"} & set(config.own_run["particles"]):
                judged += ". Longer grains stand steeper (--axes, or particles.elongation)"
        name = without_unit(metric).replace("_", " ")
        yield f"{name} {', '.join(told)}; measured {mean:.4g}{unit}: {judged}"


def _eased(lab, show):
    """The study with the upper end of how much its grains stick moved in to where a heap forms: a
    heap was measured, so that parameters at which none forms are not the material's."""
    sticky = [f for f in lab.factors if f.key in WITH_SIZE]
    config = _config(lab, "quick")
    if not sticky or config.target.metric != ANGLE:
        return lab

    def fault(levels):
        with heard("the stickiest heap that is tried", show):
            return one_run(config, config.own_run, config.experiment, levels).fault

    found, why = eased(lab.factors, sticky, fault)
    if found == lab.factors:
        return lab
    show(f"at the upper end of what holds grains together no heap forms ({why})")
    return _with_factors(lab, found, show)


def eased(
    factors: Sequence[Factor], sticky: Sequence[Factor], fault: Callable[[dict[str, float]], str]
) -> tuple[list[Factor], str]:
    """Factors whose `sticky` ones end where a heap forms, and why it did not at their old end;
    `fault` of levels {key: level} is empty where one does. They end at the half, the quarter and so
    on of their upper end, as the first of these with a heap says where all frictions are at theirs:
    there heaps stand steepest. As they were where none has a heap, or the old end has one."""
    rough = {f.key: f.high if f.key.endswith("friction") else f.centre for f in factors}
    share, why = 1.0, ""
    for _ in range(HALVINGS + 1):
        found = fault(rough | {f.key: share * f.high for f in sticky})
        if not found:
            highs = {f.key: float(f"{share * f.high:.3g}") for f in sticky if share < 1.0}
            return [narrowed(f, f.low, highs[f.key]) if highs.get(f.key, 0.0) > f.low else f
                    for f in factors], why  # fmt: skip
        share, why = 0.5 * share, why or found
    return list(factors), ""


# --- a funnel's heap alone


def _of_one_heap(lab, show):
    """(`Laboratory`, []) after a coarse heap was poured at each point of the screening."""
    points = corners(_config(lab, "full"), lab.factors)

    def pour(factors, points):
        nonlocal lab
        trials = []
        for n, point in enumerate(points, 1):
            for turn in range(CALMER + 1):
                config = _config(lab, "full")
                levels = levels_at(factors, point)
                with heard(f"heap {n} of {len(points)}", show):
                    trial = one_run(config, coarse(config.own_run), "heap", levels, tuple(point))
                if not trial.restless or turn == CALMER:
                    break
                lab = _calmer(lab, 0, turn, show)
            show(f"heap {n} of {len(points)}: {trial.found} ({trial.seconds:.0f} s)")
            trials.append(trial)
        return trials

    def again(factors, points):
        show(f"{len(points)} do not stand: they are poured again with narrower ranges")
        return pour(factors, points)

    cut, trials = shrunk(lab.factors, pour(lab.factors, points), again)
    lab = _with_factors(lab, cut, show)
    config = _config(lab, "full")
    measured, error = _measured(config, joint_targets(config)[0])
    for sentence in advice(trials, measured):
        show(sentence)
    end = beyond(trials, measured)
    if end is not None:
        (trial,) = pour(cut, [end])
        angle, sign = trial.angle_deg, 1.0 if measured > max(_angles(trials)) else -1.0
        reached = angle is not None and sign * (measured - angle) <= error
        show(
            "at the ends that bring it nearest the heap reaches yours"
            if reached
            else f"these ranges may not reach yours. {STEEPER if sign > 0.0 else FLATTER}"
        )
    return lab, []


STEEPER = (
    "A lower orifice (--height), a slower pour (--rate), a rim (--rim) and longer grains (--axes) "
    "stand steeper. Was it measured in this rig, on grains of this shape?"
)
FLATTER = "Less friction between grains or a rounder grain would be flatter"


def corners(config: Config, factors: Sequence[Factor]) -> np.ndarray:
    """The distinct points of the study's screening in the unit cube (n, factors): what has to stand
    for the study to go on."""
    coded = screening_design(factors, config.screening)[[f.code for f in factors]]
    return 0.5 * (coded.drop_duplicates().to_numpy(float) + 1.0)


def levels_at(factors: Sequence[Factor], point: np.ndarray | Sequence[float]) -> dict[str, float]:
    """Natural levels {key: value} of a point of the ranges' unit cube. point: (factors,) in [0,
    1]."""
    return {
        f.key: round(f.low + x * (f.high - f.low), 6) for f, x in zip(factors, point, strict=True)
    }


def coarse(run: Mapping[str, Any]) -> dict[str, Any]:
    """The run spec with at most COARSE grains of the same volume together, as far as the orifice
    passes them."""
    particles = run["particles"]
    count, sizes = particles["count"], particles.get("sizes")
    if count <= COARSE or sizes:
        return overlay(run, {"particles": {"count": min(count, COARSE)}})
    largest = run["geometry"]["orifice_diameter_mm"] / WIDE_ENOUGH
    diameter = particles["diameter_mm"]
    grown = max(min(diameter * (count / COARSE) ** (1 / 3), largest), diameter)
    fewer = round(count * (diameter / grown) ** 3)
    rate = run["geometry"].get("generation_rate_per_s", count) * fewer / count
    changes = {"particles": {"count": fewer, "diameter_mm": grown}}
    return overlay(run, changes | {"geometry": {"generation_rate_per_s": rate}})


def shrunk(
    factors: Sequence[Factor],
    trials: list[Trial],
    pour: Callable[[list[Factor], list[tuple]], list[Trial]],
) -> tuple[list[Factor], list[Trial]]:
    """(factors, trials) after the ends at which heaps do not stand have moved in: heaps that failed
    are poured again at the new ends, in at most ROUNDS rounds, and FURTHER ones where that is not
    enough. Where none stands nothing moves.

    pour(factors, points) -> [Trial].
    """
    cut = np.zeros((len(factors), 2))
    for turn in range(ROUNDS + FURTHER):
        failed = [k for k, t in enumerate(trials) if t.fault]
        if not failed or len(failed) == len(trials):
            break
        if turn >= ROUNDS and len(failed) <= len(trials) / 4:
            break
        ends = _shared_ends(trials, failed) if turn < ROUNDS else _telling_ends(trials)
        ends = [end for end in ends if cut[end] < MOST]
        if not ends:
            break
        for end in ends:
            cut[end] += MOVE
        points = [trials[k].point for k in failed]
        again = pour(_cut_all(factors, cut), points)
        trials = list(trials)
        for k, trial in zip(failed, again, strict=True):
            trials[k] = trial
    return _cut_all(factors, cut), trials


def _shared_ends(trials, failed):
    """(factor, side) of the ends at which the failed corners lie more often than by chance: all of
    them where any end is shared by all, else those shared by most."""
    points = np.array([trials[k].point for k in failed])
    shares = np.stack([(points == 0.0).mean(axis=0), (points == 1.0).mean(axis=0)], axis=1)
    return list(zip(*np.nonzero(shares >= shares.max()), strict=True))


def _telling_ends(trials):
    """(factor, side) of the ends at which by TELLING more of the heaps do not stand than at the
    other end."""
    points, failed = np.array([t.point for t in trials]), np.array([bool(t.fault) for t in trials])
    ends = []
    for j, at in enumerate(points.T):
        low, high = failed[at == 0.0].mean(), failed[at == 1.0].mean()
        if abs(high - low) >= TELLING:
            ends.append((j, int(high > low)))
    return ends


def _cut_all(factors, cut):
    return [_cut(f, a, 1.0 - b) for f, (a, b) in zip(factors, cut, strict=True)]


def _cut(factor, a, b):
    if (a, b) == (0.0, 1.0):
        return factor
    span = factor.high - factor.low
    return narrowed(factor, round(factor.low + a * span, 4), round(factor.low + b * span, 4))


def narrowed(factor: Factor, low: float, high: float) -> Factor:
    """A factor of a narrower range, which its description tells."""
    note = f"{factor.description}; cut from {factor.low:g} to {factor.high:g} by the pilot"
    return replace(factor, low=low, high=high, description=note)


def advice(trials: Sequence[Trial], measured: float) -> list[str]:
    """Sentences on what the heaps that do not stand ask for, and on whether those that do reach the
    measured angle [deg]."""
    rolled = sum("no heap" in t.fault for t in trials)
    clogged = sum("clogged" in t.fault for t in trials)
    found = [f"{sum(not t.fault for t in trials)} of {len(trials)} coarse heaps stand"]
    if angles := _angles(trials):
        found.append(
            f"their angles are {min(angles):.1f}° to {max(angles):.1f}°; yours is {measured:.1f}°"
        )
    if rolled > len(trials) / 4:
        found.append(
            f"{rolled} rolled off: a plate with a rim (--rim, geometry.plate_rim_height_mm) or a "
            f"lower orifice (--height) keeps them; is your own plate bare?"
        )
    if clogged:
        found.append(f"{clogged} clogged: a wider orifice, or a lifted cylinder in the laboratory")
    return found


def _angles(trials):
    return [t.angle_deg for t in trials if not t.fault and t.angle_deg is not None]


def beyond(trials: Sequence[Trial], measured: float) -> tuple[float, ...] | None:
    """The point of the unit cube at the end of each range that brings heaps nearest to a measured
    angle [deg] that is beyond all of them; None where one is as steep and one as flat, or none
    stands. Heaps that have grown into the orifice are as steep as can be; grains that roll off are
    flat."""
    angles = _angles(trials)
    grown = any(t.fault and (t.angle_deg or 0.0) >= measured for t in trials)
    if not angles or (min(angles) <= measured and (grown or measured <= max(angles))):
        return None
    sign = 1.0 if measured > max(angles) else -1.0
    points = np.array([t.point for t in trials])
    all_angles = np.array([0.0 if t.angle_deg is None else t.angle_deg for t in trials])
    return tuple(
        float(sign * all_angles[at == 1.0].mean() >= sign * all_angles[at == 0.0].mean())
        for at in points.T
    )
