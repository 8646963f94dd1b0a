"""What the colour of a grain tells, and the bar that explains it."""

from typing import Any

import matplotlib as mpl
import numpy as np

LABELS = {
    "size": ("diameter [mm]", "viridis"),
    "speed": ("speed [m/s]", "YlOrRd"),
    "order": ("poured first to last", "viridis"),
    "height": ("height [mm]", "cividis"),
}


def colour_by(choice: str, radius: np.ndarray, velocity: np.ndarray) -> str:
    """The quantity that `choice` comes to: auto is size where sizes differ, speed where grains
    move, else order. radius (n,) [m], velocity (n, 3) [m/s]."""
    if choice != "auto":
        return choice
    if np.ptp(radius) > 1e-6 * radius.max():
        return "size"
    return "speed" if np.linalg.norm(velocity, axis=1).max() > 0.1 else "order"


def values_of(
    quantity: str, position: np.ndarray, radius: np.ndarray, velocity: np.ndarray, tag: np.ndarray
) -> np.ndarray:
    """Values (n,) of a quantity, in the unit of its label. position (n, 3), radius (n,) [m],
    velocity (n, 3) [m/s], tag (n,)."""
    return {
        "size": lambda: 2e3 * radius,
        "speed": lambda: np.linalg.norm(velocity, axis=1),
        "order": lambda: np.argsort(np.argsort(tag)) / max(len(tag) - 1, 1),
        "height": lambda: 1e3 * position[:, 2],
    }[quantity]()


def colours_of(quantity: str, values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Colours (n, 3) in 0..1 of values between limits (low, high)."""
    low, high = limits
    share = np.clip((values - low) / (high - low), 0.0, 1.0) if high > low else 0.5 + 0.0 * values
    return mpl.colormaps[LABELS[quantity][1]](share)[:, :3]


def draw_bar(
    draw: Any,
    quantity: str,
    limits: tuple[float, float],
    at: tuple[float, float],
    size: tuple[int, int],
    font: Any,
    ink: Any,
) -> None:
    """Draw the colour bar with its label and its ends at (x, y) [px], `size` (width, height)
    [px]."""
    (x, y), (width, height) = at, size
    ramp = colours_of(quantity, np.linspace(0.0, 1.0, width), (0.0, 1.0))
    for k, colour in enumerate(ramp):
        draw.line([x + k, y, x + k, y + height], fill=tuple(int(255 * c) for c in colour))
    text = LABELS[quantity][0]
    if quantity != "order":
        text = f"{limits[0]:.3g} to {limits[1]:.3g}  {text}"
    draw.text((x + width + height, y + height / 2), text, font=font, fill=ink, anchor="lm")
