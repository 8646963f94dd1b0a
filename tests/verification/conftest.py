"""What a verification test measures, handed on with its report; `recording.py` writes it down."""

import matplotlib.pyplot as plt
import pytest

from calibration.figures import save, styled
from dem.fingerprint import engine_fingerprint
from recording import FIGURE, RECORD, name_of


def _hand_on(request, **values):
    test, engine = name_of(request.node.nodeid), engine_fingerprint()
    request.node.user_properties.append((RECORD, {**values, "test": test, "engine": engine}))


@pytest.fixture
def record(request):
    """record(topic, quantity, value, reference, tolerance, unit, source): assert |value -
    reference| <= tolerance.

    reference None: nothing to compare with. tolerance None: shown beside the reference and not
    judged.
    """

    def check(topic, quantity, value, reference, tolerance, unit="", source="closed form"):
        _hand_on(
            request,
            topic=topic,
            quantity=quantity,
            value=float(value),
            reference=None if reference is None else float(reference),
            tolerance=None if tolerance is None else float(tolerance),
            unit=unit,
            source=source,
        )
        if tolerance is not None:
            assert abs(value - reference) <= tolerance, (
                f"{quantity}: {value:.6g} against {reference:.6g} {unit}"
            )

    return check


@pytest.fixture
def figure(request, tmp_path_factory):
    """figure(topic, name, caption, columns=1): matplotlib figure and axes of
    docs/verification/<name>.svg."""
    drawn = {}

    def new(topic, name, caption, columns=1):
        with styled() as plt:
            fig, axes = plt.subplots(
                1, columns, figsize=(5.6 if columns == 1 else 9.6, 3.8), layout="constrained"
            )
        drawn[name] = fig
        _hand_on(request, topic=topic, figure=name, caption=caption)
        return fig, axes

    yield new
    for name, fig in drawn.items():
        if request.config.getoption("--record"):
            path = tmp_path_factory.mktemp("figure") / f"{name}.svg"
            save(fig, path)
            request.node.user_properties.append((FIGURE, (name, path.read_text("utf-8"))))
        plt.close(fig)
