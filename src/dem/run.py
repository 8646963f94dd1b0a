"""One run from a spec to its files: result.json comes last, so its existence means success."""

import json
import time
import zipfile
from pathlib import Path

import numpy as np

from dem.errors import DemError
from dem.experiments import experiment_of
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_arrays, write_json
from dem.spec import canonical


class RunContext:
    """What an experiment may ask of its surroundings: progress, frames, checkpoints and the last state."""

    def __init__(self, spec, out, progress=None):
        self.spec, self.out = spec, Path(out)
        self._progress = progress or (lambda fraction, text: None)
        self._saved = time.monotonic()
        self._frames = 0
        self.summary = {}

    @property
    def checkpoint_path(self):
        """Where the state of an unfinished run is kept."""
        return self.out / "checkpoint.npz"

    def progress(self, fraction, text):
        """Tell how far the run is, 0 to 1."""
        self._progress(fraction, text)

    def resume(self):
        """(arrays, meta) of a checkpoint of this very spec and engine, or None."""
        try:
            with np.load(self.checkpoint_path) as saved:
                arrays = {k: saved[k] for k in saved.files}
            meta = json.loads(str(arrays.pop("meta")))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None  # none yet, or not one of ours: begin anew
        if meta.pop("key") != self._key():
            return None
        self._frames = meta.pop("frames")
        return arrays, meta

    def checkpoint(self, make):
        """Save make() -> (arrays, meta) when the interval since the last time has passed."""
        if time.monotonic() - self._saved < self.spec.output.checkpoint_interval_s:
            return
        arrays, meta = make()
        meta = json.dumps(meta | {"key": self._key(), "frames": self._frames})
        write_arrays(self.checkpoint_path, arrays | {"meta": np.array(meta)})
        self._saved = time.monotonic()

    def _key(self):
        return [canonical(self.spec), engine_fingerprint()]

    def frame(self, sim):
        """Write a VTK frame when one is due."""
        interval = self.spec.output.frame_interval_s
        if interval and sim.time >= self._frames * interval:
            from dem.io.vtk import write_frame, write_walls  # VTK takes a second to import

            if self._frames == 0:
                write_walls(self.out / "frames" / "walls.vtp", sim.walls)
            write_frame(self.out / "frames" / f"grains_{self._frames:05d}.vtp", sim)
            self._frames += 1

    def finish(self, sim):
        """Keep the last state and what the numerics came to."""
        write_arrays(
            self.out / "final.npz",
            {
                "position": sim.position,
                "radius": sim.radius,
                "velocity": sim.velocity,
                "spin": sim.spin,
                "tag": sim.tag,
                "grain": sim.grain,
            },
        )
        self.summary = {
            "time_step_s": sim.time_step,
            "steps": sim.steps,
            "simulated_time_s": sim.time,
            "list_rebuilds": sim.rebuilds,
            "precision": sim.precision,
        }


def run(spec, out, progress=None):
    """Run a `RunSpec` into folder `out`; progress(fraction, text) is called along the way.

    Returns the content of result.json. Raises DemError. Whatever goes wrong, no result.json is left.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    (out / "result.json").unlink(missing_ok=True)
    context = RunContext(spec, out, progress)
    started = time.perf_counter()
    metrics = experiment_of(spec).perform(spec, context)
    bad = [k for k, v in metrics.items() if isinstance(v, float) and not np.isfinite(v)]
    if bad:
        raise DemError(f"{spec.experiment}: {', '.join(bad)} did not come out as numbers")
    result = {
        "experiment": spec.experiment,
        "seed": spec.seed,
        "spec": spec.model_dump(mode="json"),
        "engine": engine_fingerprint(),
        "metrics": metrics,
        "numerics": context.summary | {"wall_time_s": time.perf_counter() - started},
    }
    write_json(out / "result.json", result)
    context.checkpoint_path.unlink(missing_ok=True)
    return result
