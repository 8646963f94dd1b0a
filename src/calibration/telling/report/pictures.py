"""Pictures of a stage's heaps."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image, ImageDraw

from calibration.intake.tables import read_written
from calibration.runs.store import REFUSED, RunStore
from dem.render import draw_run, read_run, save_image
from dem.render.image import GROUND, INK, font_of

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study


WIDTH = 480
FROM_ABOVE = 25.0  # deg, the view of grains that form no heap: they have no flanks to draw
COLUMNS = 52  # letters in a line of a picture's words
FEWER, MARGIN = 0.75, 0.02  # height of a picture without grains, and its margin, over the width


def heaps(study: Study, source: NamedFiles, output: Sequence[str]) -> None:
    """Draw each run of a design into the folder that is the only output; a run without a value has
    the reason on its picture."""
    store = RunStore()
    Path(output[0]).mkdir(parents=True, exist_ok=True)  # a stage without runs has no picture
    for name in read_written(source.design)["run_id"].unique():
        reason = store.result(name)["numerics"].get(REFUSED, {}).get("reason", "")
        image = _drawn(read_run(store.folder(name)))
        if reason:
            _write(image, f"no value: {reason}")
        save_image(image, Path(output[0]) / f"{name}.webp")


def _drawn(run):
    """Picture of a run; bare ground where it ended without a grain."""
    if not len(run.radius):
        return Image.new("RGB", (WIDTH, int(FEWER * WIDTH)), GROUND)
    stands = "angle_of_repose_deg" in run.metrics
    view = {} if stands else {"azimuth": 0.0, "elevation": FROM_ABOVE}
    return draw_run(run, width=WIDTH, **view)


def _write(image, text):
    """Write words across the top of a picture, on ground of their own."""
    draw, font = ImageDraw.Draw(image), font_of(WIDTH)
    lines, edge = "\n".join(textwrap.wrap(text, COLUMNS)), MARGIN * WIDTH
    *_, bottom = draw.multiline_textbbox((edge, edge), lines, font=font)
    draw.rectangle([(0, 0), (image.width, bottom + edge)], fill=GROUND)
    draw.multiline_text((edge, edge), lines, font=font, fill=INK)
