"""Figures of the stages; each function returns a matplotlib Figure, `save` writes it atomically as
SVG."""

from calibration.figures.ascent import ascent_path
from calibration.figures.bench_and_scaling import numerics, scaling, sweep, yield_loci
from calibration.figures.labels import (
    ANGLE,
    PLACES,
    Response,
    label,
    parameter_words,
    response_of,
)
from calibration.figures.optimum import contours, desirability_contours, front
from calibration.figures.posterior_pairs import next_measurements, posterior_pairs, pushed_forward
from calibration.figures.pour_rate import pour_rate
from calibration.figures.pulls import pulls
from calibration.figures.push_through import pushed_through
from calibration.figures.replicates import validation
from calibration.figures.screening import half_normal, pareto
from calibration.figures.style import BLUE, GREEN, GREY, ORANGE, panel_grid, save, styled, subplots
from calibration.figures.surface import perturbation, predicted_actual, residual_panel, surfaces

__all__ = [
    "ANGLE",
    "BLUE",
    "GREEN",
    "GREY",
    "ORANGE",
    "PLACES",
    "Response",
    "ascent_path",
    "contours",
    "desirability_contours",
    "front",
    "half_normal",
    "label",
    "next_measurements",
    "numerics",
    "panel_grid",
    "parameter_words",
    "pareto",
    "perturbation",
    "posterior_pairs",
    "pour_rate",
    "predicted_actual",
    "pulls",
    "pushed_forward",
    "pushed_through",
    "residual_panel",
    "response_of",
    "save",
    "scaling",
    "styled",
    "subplots",
    "surfaces",
    "sweep",
    "validation",
    "yield_loci",
]  # fmt: skip
