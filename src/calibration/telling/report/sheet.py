"""One sheet with a picture of every heap of a study: the page shows each one small, and enlarged
when asked."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from PIL import Image

from calibration.intake.tables import read_written
from calibration.runs.store import RunStore
from calibration.statistics.numbers import fixed
from calibration.telling.report.embed import uri_of
from dem.errors import ResultError

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.figures import Response
    from calibration.study.stage import Stage


COLUMNS = 10
TELLING = 6  # heaps of a stage that are shown at once
WIDTH, HEIGHT = 400, 300  # of a heap's place on the sheet [px]
FULL = 100  # more heaps share the area of so many, so that the sheet weighs about the same
GROUND = (240, 242, 245)  # that of the pictures
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
        for heap in heaps:
            files.setdefault(heap["run"], heap.pop("file"))  # a run may be of several stages
        if heaps:
            _mark_telling(heaps)
            groups.append({"title": stage.title, "heaps": heaps})
    if not groups:
        return None
    place = {run: divmod(k, COLUMNS) for k, run in enumerate(files)}
    for heap in (heap for group in groups for heap in group["heaps"]):
        heap["y"], heap["x"] = place[heap["run"]]  # type: ignore[index]
    image = _drawn(list(files.values()))
    return {
        "image": image,
        "columns": min(COLUMNS, len(files)),
        "rows": math.ceil(len(files) / COLUMNS),
        "ratio": WIDTH / HEIGHT,
        "groups": groups,
        "heaps": sum(len(group["heaps"]) for group in groups),
        "folded": any(len(group["heaps"]) > TELLING for group in groups),
    }


def _mark_telling(heaps):
    """The lowest, the highest and those evenly between, in their order: the others look alike."""
    chosen = set(np.linspace(0, len(heaps) - 1, TELLING).round().astype(int))
    for k, heap in enumerate(heaps):
        heap["telling"] = k in chosen


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
        y = None if y is None or pd.isna(y) else y
        text = f"run {row['run']}{'' if y is None else f': {response.value(y)}'}{_left(metrics)}"
        heap = {
            "run": row["run_id"],
            "name": row["run"],
            "value": "no value" if y is None else _short(y, response),
            "text": text,
            "file": file,
        }
        found.append((math.inf if y is None else y, heap))
    return [heap for _, heap in sorted(found, key=lambda pair: pair[0])]


def _short(y, response):
    return f"{fixed(y, 1)}°" if response.unit == "°" else response.value(y)


def _metrics(run_id):
    try:
        return RunStore().result(run_id)["metrics"]
    except ResultError:
        return {}  # the study was moved here without its runs


def _left(metrics):
    """What to say of a heap whose funnel has not run empty."""
    count = metrics.get("in_funnel", 0)
    return f", {count} grains left in the funnel" if count else ""


def _without_ground(picture):
    """The picture with its ground transparent: a dark page shows it dark."""
    apart = np.abs(np.asarray(picture, int) - GROUND).max(axis=2)
    seen = np.clip((apart - NEAR[0]) / (NEAR[1] - NEAR[0]), 0.0, 1.0)
    picture.putalpha(Image.fromarray((255 * seen).astype(np.uint8)))
    return picture


def _drawn(files):
    """Pictures side by side as one WebP, each at the bottom of its place: as a data: address."""
    share = min(1.0, math.sqrt(FULL / len(files)))
    width, height = round(share * WIDTH), round(share * HEIGHT)
    rows = math.ceil(len(files) / COLUMNS)
    whole = Image.new("RGBA", (width * min(COLUMNS, len(files)), height * rows), (*GROUND, 0))
    for k, file in enumerate(files):
        with Image.open(file) as picture:
            scale = min(width / picture.width, height / picture.height)
            size = round(scale * picture.width), round(scale * picture.height)
            small = _without_ground(picture.convert("RGB").resize(size))
        row, column = divmod(k, COLUMNS)
        whole.paste(small, (column * width, (row + 1) * height - small.height))
    kept = io.BytesIO()
    whole.save(kept, "WEBP", quality=QUALITY, alpha_quality=EDGES, method=6)
    return uri_of(kept.getvalue(), "image/webp")
