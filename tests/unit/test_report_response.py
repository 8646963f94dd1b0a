"""Labels and sentences follow the metric that is calibrated."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from calibration import figures
from calibration.figures import response_of
from calibration.stages.ascent import ascent_path
from calibration.stages.optimum import contours
from calibration.stages.response_surface import (
    perturbation,
    predicted_actual,
    residual_panel,
    surfaces,
)
from calibration.stages.screening import half_normal, pareto
from calibration.stages.validation import validation_figure
from calibration.statistics.design import box_behnken
from calibration.statistics.equivalence import compare
from calibration.statistics.numbers import difference_of, fixed, signed, spread
from calibration.statistics.optimise import solve
from calibration.statistics.surface import fit_surface
from calibration.study.factors import Factor
from calibration.telling.report.embed import cell


@pytest.mark.parametrize(
    ("metric", "axis", "value"),
    [
        ("angle_of_repose_deg", "angle of repose [°]", "45.26°"),
        ("rebound_height_mm", "rebound height [mm]", "45.26 mm"),
        ("shear_stress_kPa", "shear stress [kPa]", "45.26 kPa"),
        ("bulk_density_kg_m3", "bulk density [kg/m³]", "45.26 kg/m³"),
        ("effective_restitution", "effective restitution", "45.26"),
        ("rest_time_s", "rest time [s]", "45.26 s"),
    ],
)
def test_a_metrics_name_gives_its_unit(metric, axis, value):
    response = figures.response_of(metric)
    assert response.axis == axis
    assert response.value(45.26) == value


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ((0.00729, -1.38, 1.39), ("+0.01", "−1.38", "+1.39")),
        ((13.61, 13.1, 14.12), ("+13.6", "+13.1", "+14.1")),
        ((-77.0, -1203.0, 1049.0), ("−77", "−1203", "+1049")),
        ((-0.0002, -0.4, 0.4), ("0.000", "−0.400", "+0.400")),
        ((0.0, 0.0, 0.0), ("0", "0", "0")),
    ],
)
def test_a_difference_has_the_digits_that_its_interval_bears(ends, said):
    keys = ("difference", "difference_low", "difference_high")
    assert difference_of(dict(zip(keys, ends, strict=True))) == said


def texts(figure):
    figure.canvas.draw()
    return " ".join(t.get_text() for t in figure.findobj(Text))


def test_no_figure_of_another_metric_speaks_of_degrees():
    response = figures.response_of("rebound_height_mm")
    region = [Factor(c, f"factor_{c}", f"k{c}", 0.0, 1.0) for c in "ABC"]
    design = box_behnken(region)
    noise = np.random.default_rng(0).normal(size=len(design))
    y = 40 + design[list("ABC")].sum(axis=1) + 0.1 * noise
    surface = fit_surface(design, list("ABC"), y)
    effects = pd.DataFrame(
        {
            "code": ["A", "B"],
            "name": ["a", "b"],
            "effect": [1.0, -3.0],
            "half_normal_score": [0.3, 1.1],
        }
    )
    path = pd.DataFrame(
        {"run": [1, 2], "response": [39.0, 40.0]} | {f.name: [0.1, 0.2] for f in region}
    )
    groups, measured = 40 + noise[:6].reshape(2, 3), 40 + noise[6:12]
    drawn = [
        half_normal(effects, ["B"], response),
        pareto(effects, 2.0, 2.5, 0.05, response),
        ascent_path(path, region, 40.0, 2, response),
        predicted_actual(surface, response),
        residual_panel(surface, response),
        perturbation(surface, region, response),
        surfaces(surface, region, response),
        contours(surface, region, solve(surface, 40.0), response),
        validation_figure(groups, measured, compare(groups, measured, 1.0), response),
    ]
    for figure in drawn:
        said = texts(figure)
        assert "°" not in said
        assert "angle" not in said
        assert "mm" in said
        plt.close(figure)


@pytest.mark.parametrize(
    ("value", "digits", "sign", "text"),
    [
        (-0.0004, 3, "+", "0.000"),
        (-0.04, 1, "", "0.0"),
        (0.5, 1, "+", "+0.5"),
        (-2.5, 1, "", "-2.5"),
    ],
)
def test_no_zero_has_a_sign(value, digits, sign, text):
    assert fixed(value, digits, sign) == text


@pytest.mark.parametrize(("value", "text"), [(0.0, "0"), (-0.0, "0"), (-1.5, "−1.5"), (2, "+2")])
def test_a_difference_has_a_sign_unless_it_is_none(value, text):
    assert signed(value) == text


@pytest.mark.parametrize(
    ("sd", "digits", "text"), [(0.8031, 3, "0.803"), (0.00004, 3, "0.00004"), (0.0002, 3, "0.0002")]
)
def test_no_spread_is_written_as_zero(sd, digits, text):
    assert spread(sd, digits) == text


@pytest.mark.parametrize("value", [-0.0, -1e-14])
def test_a_cell_of_the_report_has_no_signed_zero(value):
    assert cell(value) == "0"
    assert response_of("angle_of_repose_deg").value(value) == "0.00°"
