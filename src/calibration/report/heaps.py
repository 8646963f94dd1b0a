"""The heaps themselves: pictures of each stage's runs, and chosen heaps as data for the viewer."""

import base64
import json
from pathlib import Path

import numpy as np

from calibration.campaign import result_path
from calibration.figures import label
from calibration.report.embed import uri
from calibration.store import RunStore
from calibration.tables import read_written
from dem.errors import DemError, ResultError
from dem.render import read_run
from dem.render.flanks import fitted_flanks, heap_grains
from dem.render.image import plate_of

LEVELS = 65535  # of a coordinate, 16 bits


def gallery(study, key, response, metric):
    """Pictures of a stage's runs, [{uri, text}], in the order of its design."""
    tables = [p for name in ("runs", "design") if (p := study / key / f"{name}.csv").exists()]
    pictures = []
    for row in read_written(tables[0]).to_dict("records") if tables else []:
        path = study / "heaps" / key / f"{row['run_id']}.webp"
        if path.exists():
            metrics = _metrics(row["run_id"])
            found = row.get("response", metrics.get(metric))
            value = "" if found is None else f": {response.value(found)}"
            text = f"run {row['run']}{value}{_left(metrics)}"
            pictures.append({"uri": uri(path), "text": text})
    return pictures


def _metrics(run_id):
    try:
        return RunStore().result(run_id)["metrics"]
    except ResultError:
        return {}  # the study was moved here without its runs


def _left(metrics):
    """What to say of a heap whose funnel has not run empty."""
    count = metrics.get("in_funnel", 0)
    return f", {count} grains left in the funnel" if count else ""


def viewer(study, response):
    """JSON for the page's viewer: the validated heap nearest to the mean, and the screening's
    extremes; None where no heap's state is at hand."""
    scenes = [
        scene
        for name, text in _chosen(study, response)
        if (scene := _scene(name, text)) is not None
    ]
    return json.dumps(scenes) if scenes else None


def _chosen(study, response):
    """(run_id, name) of the heaps to show."""
    chosen = []
    for stage, picks in (("validation", "middle"), ("screening", "extremes")):
        path = study / stage / "runs.csv"
        if not path.exists():
            continue
        runs = read_written(path)
        y = runs["response"]
        at = [(y - y.mean()).abs().idxmin()] if picks == "middle" else [y.idxmin(), y.idxmax()]
        names = ["calibrated"] if picks == "middle" else ["lowest of the screening", "highest"]
        for k, name in zip(at, names, strict=True):
            chosen.append((runs.loc[k, "run_id"], f"{name}, {response.value(y[k])}"))
    return chosen


def _scene(run_id, name):
    """One heap: grains in the order of pouring as 16-bit numbers x, y, z, radius over `scale`
    [mm]."""
    try:
        run = read_run(Path(result_path(run_id)).parent)
    except DemError:
        return None  # the result was moved here without its state
    plate = plate_of(run.spec)
    if plate is None:
        return None
    order = np.argsort(run.tag)
    state = 1e3 * np.column_stack([run.position, run.radius])[order]
    scale = 1.001 * float(np.abs(state).max())
    packed = np.rint((state / scale + 1.0) * 0.5 * LEVELS).astype("<u2")
    return {
        "name": label(name),
        "plate": 1e3 * plate,
        "cone": _cone(run, plate),
        "angle": run.metrics["angle_of_repose_deg"],
        "scale": scale,
        "count": len(state),
        "grains": base64.b64encode(packed.tobytes()).decode(),
    }


def _cone(run, plate):
    """Radius [mm] at which the cone of the run's angle of repose meets the plate: mean of the
    fitted lines."""
    part = heap_grains(run.position, run.radius, run.velocity, plate)
    position, radius = run.position[part], run.radius[part]
    toes = [
        abs(flank.end[0])
        for azimuth in range(0, 180, 15)
        for flank in fitted_flanks(position, radius, plate, azimuth)
        if flank
    ]
    return 1e3 * float(np.mean(toes))
