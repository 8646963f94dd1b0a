"""The outline of what stands before a plain backdrop: in each column of a picture the height of its
edge.

The backdrop is a smooth surface of colour, fitted to the margins of the picture. From the first
pixel that leaves it
the column is followed down to the first steep edge: a shadow is soft, the edge of a heap is not.
"""

import numpy as np
from scipy import ndimage

BLUR = 1.5  # px, against the noise of the sensor
TOP, SIDES = 0.15, 0.06  # shares of the picture that are taken for the backdrop
STEEP = 0.25  # of the usual steepness of the outline: less is a shadow
LEAST_CONTRAST = 4.0  # of the outline, in units of CIELAB; an eye tells 2 apart
NOISE = 6.0  # spreads of the backdrop that do not count
MEDIAN = 5  # columns
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""Linear sRGB to CIE XYZ; its rows add up to the white of D65."""


class NoOutlineError(ValueError):
    """A picture in which no heap can be told from the backdrop."""


def outline(picture: np.ndarray) -> np.ndarray:
    """(columns,) row of the outline from the top, nan where there is none; picture (rows, columns,
    3), 0 to 1.

    Raises NoOutlineError where nothing stands out.
    """
    lab = cielab(picture)
    smooth = ndimage.gaussian_filter(lab, (BLUR, BLUR, 0))
    away = np.linalg.norm(smooth - _backdrop(smooth), axis=2)
    top = slice(0, int(TOP * len(away)))
    threshold = max(LEAST_CONTRAST, NOISE * float(np.median(away[top])))
    return _refined(smooth, _first_foreground(away > threshold), top)


def cielab(picture: np.ndarray) -> np.ndarray:
    """CIELAB (rows, columns, 3) of an sRGB picture, 0 to 1, for the standard light D65 (IEC
    61966-2-1; CIE 15, the observer of 2 degrees)."""
    linear = np.where(picture > 0.04045, ((picture + 0.055) / 1.055) ** 2.4, picture / 12.92)
    xyz = linear @ TO_XYZ.T / TO_XYZ.sum(axis=1)
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz * (29 / 6) ** 2 / 3 + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _backdrop(lab):
    """The backdrop's colour at each pixel: a quadratic surface through the margins, outliers left
    out twice."""
    rows, columns = lab.shape[:2]
    y, x = np.linspace(-1.0, 1.0, rows)[:, None], np.linspace(-1.0, 1.0, columns)
    margin = np.zeros((rows, columns), bool)
    margin[: int(TOP * rows)] = True
    side = max(int(SIDES * columns), 1)
    margin[: rows // 2, :side] = margin[: rows // 2, -side:] = True
    used = np.flatnonzero(margin.ravel())[::7]  # a sample is enough for six terms
    row, column = np.divmod(used, columns)
    a = np.stack(_quadratic(x[column], y[row, 0]), axis=1)
    b = lab.reshape(-1, 3)[used]
    for _ in range(3):
        fit = np.linalg.lstsq(a, b, rcond=None)[0]
        off = np.linalg.norm(b - a @ fit, axis=1)
        kept = off <= 3.0 * np.median(off) + 1e-9
        a, b = a[kept], b[kept]
    surface = np.zeros(lab.shape)
    for term, colour in zip(_quadratic(x, y), fit, strict=True):  # never all terms of all pixels
        surface += term[..., None] * colour
    return surface


def _quadratic(x, y):
    """The six terms of a quadratic surface at places x, y, each of their common shape."""
    shape = np.broadcast_shapes(np.shape(x), np.shape(y))
    return [np.broadcast_to(t, shape) for t in (1.0, x, y, x * x, x * y, y * y)]


def _first_foreground(there):
    """(columns,) first row from the top of the largest thing before the backdrop, nan where there
    is none."""
    labels, _ = ndimage.label(there, np.ones((3, 3)))
    sizes = np.bincount(labels.ravel())[1:]
    if not len(sizes) or sizes.max() < 0.01 * there.size:
        raise NoOutlineError("nothing stands out from the backdrop")
    mask = labels == 1 + int(np.argmax(sizes))
    found = mask.any(axis=0)
    return np.where(found, mask.argmax(axis=0), np.nan)


def _refined(lab, first, backdrop):
    """The outline to a part of a pixel: the first steep edge at or below `first`.

    Only the change down a column counts: a stripe of the backdrop is soft along it, a flank is not.
    """
    parts = (ndimage.gaussian_filter1d(lab[..., k], BLUR, axis=0, order=1) for k in range(3))
    steep = np.sqrt(sum(p * p for p in parts))
    columns = np.flatnonzero(np.isfinite(first))
    starts = {c: max(int(first[c]) - 8, 0) for c in columns}
    usual = np.median([steep[starts[c] :, c].max() for c in columns])
    least = max(STEEP * usual, NOISE * float(np.median(steep[backdrop])))
    rows = np.full(len(first), np.nan)
    for c in columns:
        rows[c] = starts[c] + _first_peak(steep[starts[c] :, c], least)
    rows[columns] = ndimage.median_filter(rows[columns], MEDIAN, mode="nearest")
    return rows


def _first_peak(values, least):
    """Place of the first local maximum of at least `least`, to a part of a step. If there is none,
    the place of the largest value."""
    inner = values[1:-1]
    peaks = 1 + np.flatnonzero((inner >= values[:-2]) & (inner > values[2:]) & (inner >= least))
    k = int(peaks[0]) if len(peaks) else int(np.argmax(values))
    if not 0 < k < len(values) - 1:
        return float(k)
    before, at, after = values[k - 1 : k + 2]
    bend = before - 2.0 * at + after
    return k + (0.5 * (before - after) / bend if bend < 0 else 0.0)
