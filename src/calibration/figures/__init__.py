"""Figures of the stages; each function returns a matplotlib Figure, `save` writes it atomically as
SVG."""

from calibration.figures.labels import (
    ANGLE,
    PLACES,
    Response,
    label,
    parameter_words,
    response_of,
)
from calibration.figures.posterior_pairs import posterior_pairs
from calibration.figures.push_through import pushed_through
from calibration.figures.style import BLUE, GREEN, GREY, ORANGE, panel_grid, save, styled, subplots

__all__ = [
    "ANGLE",
    "BLUE",
    "GREEN",
    "GREY",
    "ORANGE",
    "PLACES",
    "Response",
    "label",
    "panel_grid",
    "parameter_words",
    "posterior_pairs",
    "pushed_through",
    "response_of",
    "save",
    "styled",
    "subplots",
]  # fmt: skip
