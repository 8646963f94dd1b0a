"""The photograph with what was fitted to it."""

from pathlib import Path

from PIL import ImageDraw, ImageFont

from calibration.files import replacing
from calibration.intake.photo.measure import HeapPhoto, open_picture

OUTLINE, FLANK, BASE = (255, 210, 0), (214, 40, 40), (30, 120, 220)


def draw_fit(photo: HeapPhoto, out: str | Path) -> None:
    """Write the picture with outline, base line and flanks to `out`."""
    image = open_picture(photo.path)
    image = image.resize([max(round(s / photo.reduced), 1) for s in image.size])
    draw = ImageDraw.Draw(image)
    width = max(2, image.width // 400)
    draw.point([tuple(p) for p in photo.outline], fill=OUTLINE)
    draw.line(photo.base, fill=BASE, width=width)
    font = ImageFont.load_default(size=max(14, image.width // 40))
    for line, angle in zip(photo.flanks, (photo.left_deg, photo.right_deg), strict=True):
        draw.line(line, fill=FLANK, width=width)
        draw.text(line[0], f"{angle:.1f}°", font=font, fill=FLANK, anchor="mb")
    with replacing(out) as partial:
        image.save(partial)
