"""The figures show the numbers they are given, keep their labels apart, and are written whole and
reproducibly."""

from dataclasses import replace
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from calibration import figures
from calibration.stages.optimum import contours
from calibration.stages.response_surface import predicted_actual
from calibration.stages.screening import half_normal, pareto
from calibration.stages.validation import validation_figure
from calibration.statistics.equivalence import compare
from calibration.statistics.optimise import solve
from calibration.statistics.screening import screen, significant
from calibration.statistics.surface import fit_surface
from calibration.study.factors import read_factors
from facts import ROOT, tells
from paper_tables import measured_angles, paper_table, simulated_angles


@pytest.fixture(scope="module")
def factors():
    return {f.code: f for f in read_factors(ROOT / "config" / "factors.tsv")}


@pytest.fixture(scope="module")
def screening(factors):
    runs = paper_table("table06_plackett_burman")
    result = screen(runs, list(factors), runs["angle_deg"])
    return replace(
        result, table=result.table.assign(name=[factors[c].name for c in result.table["code"]])
    )


@pytest.fixture(scope="module")
def region(factors):
    levels = paper_table("table11_coding").set_index("factor")
    return [
        replace(factors[c], low=levels.loc[x, "low"], high=levels.loc[x, "high"])
        for c, x in zip("GEC", "XYZ", strict=True)
    ]


@pytest.fixture(scope="module")
def surface():
    runs = paper_table("table11_box_behnken").rename(columns={"X": "G", "Y": "E", "Z": "C"})
    return fit_surface(runs, list("GEC"), runs["angle_deg"])


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def overlapping(figure):
    """Pairs of texts drawn over each other, of all panels without depth."""
    figure.canvas.draw()
    pairs = []
    for ax in figure.axes:
        if ax.name == "3d":
            continue
        texts = [*ax.texts, *ax.get_xticklabels(), *ax.get_yticklabels(), ax.xaxis.label, ax.title]
        boxes = [
            (t.get_text(), t.get_window_extent()) for t in texts if t.get_text() and t.get_visible()
        ]
        pairs += [(a, b) for (a, x), (b, y) in combinations(boxes, 2) if x.overlaps(y)]
    return pairs


def test_half_normal_names_what_goes_on(screening):
    figure = half_normal(screening.table, significant(screening, 0.05), figures.ANGLE)
    texts = [t.get_text() for t in figure.axes[0].texts]
    assert [tells(t, "rolling friction") for t in texts if t.startswith("G ")] == [True]
    assert "A" in texts
    drawn = np.vstack([c.get_offsets() for c in figure.axes[0].collections])
    assert sorted(drawn[:, 0]) == pytest.approx(sorted(screening.table["effect"].abs()))
    assert not overlapping(figure)


def test_pareto_is_sorted_with_its_limits(screening):
    figure = pareto(
        screening.table, screening.t_limit, screening.bonferroni_limit, 0.01, figures.ANGLE
    )
    ax = figure.axes[0]
    widths = [bar.get_width() for bar in ax.patches]
    assert widths == sorted(widths)
    assert [line.get_xdata()[0] for line in ax.lines] == [
        screening.t_limit,
        screening.bonferroni_limit,
    ]
    [legend] = figure.legends
    assert {"t limit 1 %", "Bonferroni 1 %"} < {t.get_text() for t in legend.get_texts()}
    assert not overlapping(figure)


def test_contours_draw_the_solution_set_through_the_chosen_point(surface, region):
    solution = solve(surface, 45.27)
    figure = contours(surface, region, solution, figures.ANGLE)
    panels = [a for a in figure.axes if a.get_xlabel()]
    assert len(panels) == 3
    for ax, (i, j) in zip(panels, ((0, 1), (0, 2), (1, 2)), strict=True):
        marker = ax.lines[-1]
        for value, k in ((marker.get_xdata()[0], i), (marker.get_ydata()[0], j)):
            assert value == pytest.approx(region[k].natural(float(solution.chosen[k])))
    assert not overlapping(figure)


def test_validation_shows_every_value():
    simulated, measured = simulated_angles(), measured_angles().ravel()
    figure = validation_figure(
        simulated, measured, compare(simulated, measured, margin=1.0), figures.ANGLE
    )
    drawn = [c.get_offsets() for c in figure.axes[0].collections if len(c.get_offsets()) > 1]
    assert sum(len(d) for d in drawn) == 50
    assert not overlapping(figure)


def test_saving_is_reproducible_keeps_text_and_leaves_no_partial_file(tmp_path, surface):
    paths = [tmp_path / "deep" / f"{n}.svg" for n in "ab"]
    for path in paths:
        figures.save(predicted_actual(surface, figures.ANGLE), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert "predicted by" in paths[0].read_text()
    assert sorted(p.name for p in paths[0].parent.iterdir()) == ["a.svg", "b.svg"]
    assert not plt.get_fignums()
