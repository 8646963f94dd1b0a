"""The engine's own linear algebra: against closed forms, and the same whatever the last bits
are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dem.linear import principal_axes

SETTINGS = settings(max_examples=60, deadline=None, derandomize=True)
unit = st.floats(-1, 1)
direction = st.tuples(unit, unit, unit).filter(lambda v: np.linalg.norm(v) > 0.1)


def frame(first, second):
    """Right-handed axes (3, 3) in columns, out of two directions."""
    a = np.array(first) / np.linalg.norm(first)
    b = np.cross(a, second)
    if np.linalg.norm(b) < 0.1:
        b = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
    b /= np.linalg.norm(b)
    return np.column_stack([a, b, np.cross(a, b)])


moment = st.floats(0.1, 10)


@SETTINGS
@given(first=direction, second=direction, moments=st.tuples(moment, moment, moment))
def test_principal_axes_bring_a_tensor_onto_its_diagonal(first, second, moments):
    axes = frame(first, second)
    tensor = axes @ np.diag(moments) @ axes.T
    found, turned = principal_axes(tensor[None])
    assert found[0] == pytest.approx(sorted(moments), rel=1e-12)
    assert turned[0].T @ turned[0] == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turned[0]) == pytest.approx(1.0, abs=1e-12)
    # moments that are nearly alike count as alike, and then their axes are chosen
    assert turned[0].T @ tensor @ turned[0] == pytest.approx(np.diag(found[0]), abs=1e-5)


@pytest.mark.parametrize("alike", [(1.0, 3.0, 3.0), (1.0, 1.0, 3.0), (2.0, 2.0, 2.0)])
@SETTINGS
@given(axis=direction, noise=st.tuples(*[st.floats(-1e-15, 1e-15)] * 6))
def test_axes_of_a_body_of_revolution_do_not_turn_with_the_last_bits(alike, axis, noise):
    axes = frame(axis, (0.3, -0.5, 0.7))
    if alike[0] == alike[1]:
        axes = axes[:, [1, 2, 0]]
    tensor = axes @ np.diag(alike) @ axes.T
    rounded = tensor.copy()
    for value, (p, q) in zip(noise, ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)), strict=True):
        rounded[p, q] += value
        rounded[q, p] = rounded[p, q]
    _, turned = principal_axes(np.array([tensor, rounded]))
    single = axes[:, 0] if alike[0] < alike[1] else axes[:, 2]
    tie = np.sort(np.abs(single))
    # where two components of the axis are as large or as small as each other, the choice between
    # them is open
    if tie[2] - tie[1] > 1e-9 and tie[1] - tie[0] > 1e-9:
        assert turned[1] == pytest.approx(turned[0], abs=1e-12)
    assert np.linalg.det(turned[1]) == pytest.approx(1.0, abs=1e-12)
