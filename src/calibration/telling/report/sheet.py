"""The heaps of a study: pictures of a stage's runs; for the page one sheet of them, shown small and
enlarged when asked, and chosen heaps as data for its viewer."""

import base64
import io
import json
import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image, ImageDraw

from calibration.chain.study import NamedFiles, Results, Study
from calibration.figures import Response, label
from calibration.intake.tables import read_written
from calibration.runs.store import REFUSED, RunStore
from calibration.statistics.numbers import fixed
from calibration.study.stage import Stage
from calibration.telling.report.embed import uri_of
from dem.errors import DemError, ResultError
from dem.render import draw_run, read_run, save_image
from dem.render.image import GROUND, INK, fitted_flanks, font_of, heap_grains, plate_of

COLUMNS = 10
TELLING = 6  # heaps of a stage that are shown at once
WIDTH, HEIGHT = 400, 300  # of a heap's place on the sheet [px]
FULL = 100  # more heaps share the area of so many, so that the sheet weighs about the same
NEAR = (6, 30)  # of the ground, in shades of a colour: transparent, and no longer so
EDGES = 10  # of WebP, of what is transparent
QUALITY = 30  # of WebP: grains of 8 px keep their edges; a hundred heaps weigh 1 MB


def sheet(
    study: Path, stages: Mapping[str, Stage], response: Response, metric: str
) -> dict[str, Any] | None:
    """The sheet as the page needs it, or None where no heap has a picture.

    `image` (a data: address), `columns` and `rows` of the sheet, `ratio` (width over height of a
    place), `heaps` (how many), `folded` (whether some are shown only when asked for), and `groups`,
    one a stage in the order of the page: {title, heaps}. A heap is {run, name, value, text,
    telling, x, y}, with x and y its place. The heaps of a group stand in the order of their
    response.
    """
    groups, files = [], {}  # type: ignore[var-annotated]
    for stage in stages.values():
        heaps = _heaps(study, stage.pictured, response, metric) if stage.pictured else []
        # the lowest, the highest and those evenly between: the others look alike
        telling = np.linspace(0, len(heaps) - 1, TELLING).round()
        for k, heap in enumerate(heaps):
            file = heap.pop("file")
            files.setdefault(heap["run"], (len(files), file))  # a run may be of several stages
            heap["y"], heap["x"] = divmod(files[heap["run"]][0], COLUMNS)
            heap["telling"] = k in telling
        if heaps:
            groups.append({"title": stage.title, "heaps": heaps})
    if not groups:
        return None
    return {
        "image": _drawn([file for _, file in files.values()]),
        "columns": min(COLUMNS, len(files)),
        "rows": math.ceil(len(files) / COLUMNS),
        "ratio": WIDTH / HEIGHT,
        "groups": groups,
        "heaps": sum(len(group["heaps"]) for group in groups),
        "folded": any(len(group["heaps"]) > TELLING for group in groups),
    }


def _heaps(study, key, response, metric):
    """Heaps of a plan that have a picture, those without a response last."""
    tables = [p for name in ("runs", "design") if (p := study / key / f"{name}.csv").exists()]
    found = []
    for row in read_written(tables[0]).to_dict("records") if tables else []:
        file = study / "heaps" / key / f"{row['run_id']}.webp"
        if not file.exists():
            continue
        metrics = _metrics(row["run_id"])
        y = row.get("response", metrics.get(metric))
        heap = {"run": row["run_id"], "name": row["run"], "file": file}
        heap |= {"value": "no value", "text": f"run {row['run']}"}
        if known := y is not None and not pd.isna(y):
            heap["value"] = f"{fixed(y, 1)}°" if response.unit == "°" else response.value(y)
            heap["text"] += f": {response.value(y)}"
        if left := metrics.get("in_funnel"):
            heap["text"] += f", {left} grains left in the funnel"
        found.append((y if known else math.inf, heap))
    return [heap for _, heap in sorted(found, key=lambda pair: pair[0])]


def _metrics(run_id):
    try:
        return RunStore().result(run_id)["metrics"]
    except ResultError:
        return {}  # the study was moved here without its runs


def _drawn(files):
    """Pictures side by side as one WebP, each at the bottom of its place: as a data: address. Their
    ground is transparent: a dark page shows it dark."""
    share = min(1.0, math.sqrt(FULL / len(files)))
    width, height = round(share * WIDTH), round(share * HEIGHT)
    rows = math.ceil(len(files) / COLUMNS)
    whole = Image.new("RGBA", (width * min(COLUMNS, len(files)), height * rows), (*GROUND, 0))
    for k, file in enumerate(files):
        with Image.open(file) as picture:
            scale = min(width / picture.width, height / picture.height)
            size = round(scale * picture.width), round(scale * picture.height)
            small = picture.convert("RGB").resize(size)
        apart = np.abs(np.asarray(small, int) - GROUND).max(axis=2)
        seen = np.clip((apart - NEAR[0]) / (NEAR[1] - NEAR[0]), 0.0, 1.0)
        small.putalpha(Image.fromarray((255 * seen).astype(np.uint8)))
        row, column = divmod(k, COLUMNS)
        whole.paste(small, (column * width, (row + 1) * height - small.height))
    kept = io.BytesIO()
    whole.save(kept, "WEBP", quality=QUALITY, alpha_quality=EDGES, method=6)
    return uri_of(kept.getvalue(), "image/webp")


LEVELS = 65535  # of a coordinate, 16 bits


def viewer(study: Path, response: Response) -> dict[str, str] | None:
    """`scenes`, JSON for the page's viewer: the validated heap nearest to the mean, and the
    screening's extremes; `first`, the run of the first one. None where no heap's state is at
    hand."""
    found = [
        (run_id, scene)
        for run_id, text in _chosen(study, response)
        if (scene := _scene(run_id, text)) is not None
    ]
    if not found:
        return None
    return {"scenes": json.dumps([scene for _, scene in found]), "first": found[0][0]}


def _chosen(study, response):
    """(run_id, name) of the heaps to show."""
    picks = (
        ("validation", "calibrated", lambda y: (y - y.mean()).abs().idxmin()),
        ("screening", "lowest of the screening", lambda y: y.idxmin()),
        ("screening", "highest", lambda y: y.idxmax()),
    )
    for stage, name, pick in picks:
        runs = Results(study).table(stage, "runs")
        if runs is not None:
            row = runs.loc[pick(runs["response"])]
            yield row["run_id"], f"{name}, {response.value(row['response'])}"


def _scene(run_id, name):
    """One heap: grains in the order of pouring as 16-bit numbers x, y, z, radius over `scale`
    [mm]."""
    try:
        run = read_run(RunStore().folder(run_id))
    except DemError:
        return None  # the result was moved here without its state
    plate = plate_of(run.spec)
    if plate is None or not len(run.tag):  # another program may leave no grains
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


DRAWN = 480  # px across a picture
FROM_ABOVE = 25.0  # deg, the view of grains that form no heap: they have no flanks to draw
LETTERS = 52  # in a line of a picture's words
FEWER, MARGIN = 0.75, 0.02  # height of a picture without grains, and its margin, over the width


def heaps(study: Study, source: NamedFiles, output: Sequence[str]) -> None:
    """Draw each run of a design into the folder that is the only output; a run without a value has
    the reason on its picture."""
    store = RunStore()
    Path(output[0]).mkdir(parents=True, exist_ok=True)  # a stage without runs has no picture
    for name in read_written(source.design)["run_id"].unique():
        reason = store.result(name)["numerics"].get(REFUSED, {}).get("reason", "")
        image = _picture(read_run(store.folder(name)))
        if reason:
            _write(image, f"no value: {reason}")
        save_image(image, Path(output[0]) / f"{name}.webp")


def _picture(run):
    """Picture of a run; bare ground where it ended without a grain."""
    if not len(run.radius):
        return Image.new("RGB", (DRAWN, int(FEWER * DRAWN)), GROUND)
    stands = "angle_of_repose_deg" in run.metrics
    view = {} if stands else {"azimuth": 0.0, "elevation": FROM_ABOVE}
    return draw_run(run, width=DRAWN, **view)


def _write(image, text):
    """Write words across the top of a picture, on ground of their own."""
    draw, font = ImageDraw.Draw(image), font_of(DRAWN)
    lines, edge = "\n".join(textwrap.wrap(text, LETTERS)), MARGIN * DRAWN
    *_, bottom = draw.multiline_textbbox((edge, edge), lines, font=font)
    draw.rectangle([(0, 0), (image.width, bottom + edge)], fill=GROUND)
    draw.multiline_text((edge, edge), lines, font=font, fill=INK)
