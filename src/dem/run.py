"""One run from a spec to its files: result.json comes last, so its existence means success.

A run is made by one process at a time, which holds the lock in its folder. The lock ends with the
process, however that ends.
"""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from filelock import FileLock, Timeout

from dem.errors import BusyError, DemError, MeasureError, ResultError, StoppedError
from dem.experiments import experiment_of
from dem.experiments.phases import over_weight
from dem.fingerprint import engine_fingerprint
from dem.io.files import read_checked_arrays, sweep_partial, write_arrays, write_checked_arrays
from dem.results import FAILED, RESULT, STATE, is_current, read_result, run_name, write_result
from dem.spec import RunSpec, canonical

if TYPE_CHECKING:
    from dem.simulation import Simulation


class RunContext:
    """What an experiment may ask of its surroundings: progress, frames, checkpoints and the last
    state; `notes` are what the reader of the result must know beside its numbers."""

    def __init__(
        self,
        spec: RunSpec,
        out: str | Path,
        progress: Callable[[float, str], object] | None = None,
        stop: threading.Event | None = None,
    ) -> None:
        self.spec, self.out = spec, Path(out)
        self.checkpoint_path = self.out / "checkpoint.npz"
        self._progress = progress or (lambda fraction, text: None)
        self._stop = stop or threading.Event()
        self._fraction, self._stopping = 0.0, False
        self._saved = time.monotonic()
        self._frames = 0
        self.summary, self.notes = {}, []  # type: dict[str, Any], list[str]

    def progress(self, fraction: float, text: str) -> None:
        """Tell how far the run is, 0 to 1. Raises StoppedError where the run was asked to stop and
        has come here twice since without a checkpoint between."""
        self._fraction = fraction
        self._progress(fraction, text)
        if self._stopping:
            told = "this experiment keeps no checkpoint and begins anew"
            raise StoppedError(f"stopped at {100 * fraction:.0f} %; {told}")
        self._stopping = self._stop.is_set()

    def resume(self) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
        """(arrays, meta) of a checkpoint of this very spec and engine, or None; one that is damaged
        is told of."""
        try:
            arrays = read_checked_arrays(self.checkpoint_path)
            meta = json.loads(str(arrays.pop("meta")))
            if meta.pop("key") != self._key():
                return None
            _refuse_not_finite(arrays)
            self._frames = meta.pop("frames")
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever a damaged file leads to: begin anew
            self._progress(0.0, f"checkpoint.npz is not used, the run begins anew: {error}")
            return None
        return arrays, meta

    def checkpoint(self, make: Callable[[], tuple[dict[str, np.ndarray], dict[str, Any]]]) -> None:
        """Save make() -> (arrays, meta) when the interval since the last time has passed, or when
        the run is asked to stop, which it then does: raises StoppedError."""
        stopping = self._stop.is_set()
        due = time.monotonic() - self._saved >= self.spec.output.checkpoint_interval_s
        if not (stopping or due):
            return
        arrays, meta = make()
        _refuse_not_finite(arrays)
        meta = json.dumps(meta | {"key": self._key(), "frames": self._frames})  # type: ignore[assignment]
        write_checked_arrays(self.checkpoint_path, arrays | {"meta": np.array(meta)})
        self._saved = time.monotonic()
        if stopping:
            more = "and the run goes on from there when it is started again"
            state = f"the state is in {self.checkpoint_path}, {more}"
            raise StoppedError(f"stopped at {100 * self._fraction:.0f} %; {state}")

    def _key(self):
        return [canonical(self.spec), engine_fingerprint()]

    def frame(self, sim: Simulation) -> None:
        """Write a VTK frame when one is due."""
        interval = self.spec.output.frame_interval_s
        if interval and sim.time >= self._frames * interval:
            from dem.io.vtk import write_frame, write_walls  # few runs do

            if self._frames == 0:
                write_walls(self.out / "frames" / "walls.vtp", sim.walls, sim.position)
            write_frame(self.out / "frames" / f"grains_{self._frames:05d}.vtp", sim)
            self._frames += 1

    def finish(self, sim: Simulation, ended: str = "as far as asked") -> None:
        """Keep the last state, what the numerics came to, and why the run `ended`.

        Walls are kept as they stand: kind (e,) and parameters (e, 9) of each element, origin (e, 3)
        [m] and rotation (e, 3, 3) of its body.
        """
        from dem.measure.collision import restitution_error, usual_speed

        kept = ("position", "radius", "velocity", "spin", "tag", "grain")
        state, walls = {name: getattr(sim, name) for name in kept}, sim.wall_state
        state |= {"wall_kind": walls.kind, "wall_parameters": walls.parameters}
        state["wall_origin"] = walls.origin[walls.body]
        write_arrays(self.out / STATE, state | {"wall_rotation": walls.rotation[walls.body]})
        speed = usual_speed(self.spec)
        self.summary = {
            "time_step_s": sim.time_step,
            "steps": sim.steps,
            "simulated_time_s": sim.time,
            "ended": ended,
            "list_rebuilds": sim.rebuilds,
            "precision": sim.precision,
            "wall_force_over_weight": over_weight(sim, walls.force.sum(0)),
            "restitution_error": restitution_error(self.spec, speed),
            "restitution_error_speed_m_s": speed,
        }


def _refuse_not_finite(arrays):
    """A state with a particle that is nowhere is no state to go on from."""
    for name in ("particles_position", "particles_kinetic"):
        if name in arrays and not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} holds values that are not finite")


def run(
    spec: RunSpec,
    out: str | Path,
    progress: Callable[[float, str], object] | None = None,
    *,
    again: bool = True,
    wait: bool = True,
    maker: Callable[[RunSpec, RunContext], dict[str, Any]] | None = None,
) -> dict[str, Any]:
    """Run a `RunSpec` into folder `out`; progress(fraction, text) is called along the way.

    again: make the run even where its result is there, by this engine and undamaged. wait: wait for
    a process that is making the same run, in place of raising BusyError. maker(spec, context) ->
    metrics makes the run of a spec that names another engine. Returns the content of result.json.
    Raises DemError. Whatever goes wrong, no result.json is left. A SIGTERM ends the run with
    StoppedError, after a checkpoint where the experiment keeps one.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with _only_writer(out, wait, progress), _stop_on_sigterm() as stop:
        found = None if again else finished(out)
        if found:
            return found
        sweep_partial(out)
        for name in (RESULT, FAILED):
            (out / name).unlink(missing_ok=True)
        context = RunContext(spec, out, progress, stop)
        result = _make(spec, context, maker)
        context.checkpoint_path.unlink(missing_ok=True)
        return result


def finished(out: str | Path) -> dict[str, Any] | None:
    """Content of a folder's result.json where it is whole and of this engine, else None."""
    try:
        result = read_result(out)
    except ResultError:
        return None
    return result if is_current(result["engine"]) else None


def _make(spec, context, maker):
    started, name = time.perf_counter(), run_name(spec)
    if spec.engine is not None and maker is None:
        raise DemError(f"runs of this spec are made by {spec.engine.name}, from a study")
    perform = experiment_of(spec).perform if spec.engine is None else maker
    metrics = perform(spec, context)
    bad = [k for k, v in metrics.items() if isinstance(v, float) and not np.isfinite(v)]
    if bad:
        raise MeasureError(f"{spec.experiment}: {', '.join(bad)} did not come out as numbers")
    if run_name(spec) != name:
        raise DemError(f"{spec.experiment}: a file that the run reads changed while it went on")
    numerics = context.summary | {"wall_time_s": time.perf_counter() - started}
    if context.notes:
        numerics["notes"] = context.notes
    return write_result(context.out, spec, metrics, numerics)


@contextmanager
def _only_writer(out, wait, progress):
    """Hold the lock of a run's folder. Its file goes with the run's success; who waited for it
    finds the result."""
    lock = FileLock(out / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        text = f"{out}: another process is making this run"
        if not wait:
            raise BusyError(text) from None
        if progress:
            progress(0.0, f"{text}; waiting for it")
        lock.acquire()
    try:
        yield
        (out / ".lock").unlink(missing_ok=True)
    finally:
        lock.release()


@contextmanager
def _stop_on_sigterm():
    """An event that a SIGTERM sets. Only a main thread can ask for signals; in another the event is
    never set."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.signal(signal.SIGTERM, lambda *_: stop.set())
    try:
        yield stop
    finally:
        signal.signal(signal.SIGTERM, before)
