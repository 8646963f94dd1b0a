"""Small linear algebra in a fixed order of operations: sums, products, quotients and roots of
single elements.

BLAS and LAPACK choose their kernel by the processor, and each rounds its own way; grains in a heap
make another heap out of the last bit. Nothing that a run's result depends on may call them, which
`np.linalg`, `@`, `np.dot`, `np.einsum`, `np.convolve` and `np.polyfit` do.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

ALIKE = 1e-6  # moments that differ by less than this share of the largest count as equal
SWEEPS = 12  # Jacobi's error squares in each; five are enough for a double
NOTHING = 1e-20  # of the largest element: no longer turned to zero
_TURNS = ((0, 1), (0, 2), (1, 2))


def length(vectors: ArrayLike) -> Any:
    """Euclidean length of vectors (..., 3)."""
    v = np.asarray(vectors, float)
    x, y, z = v.transpose(v.ndim - 1, *range(v.ndim - 1))
    return np.sqrt(x * x + y * y + z * z)


def into_axes(axes: np.ndarray, vectors: ArrayLike) -> np.ndarray:
    """Components of vectors (..., 3) along the columns of axes (..., 3, 3): axes.T @ vector."""
    return (axes * np.asarray(vectors, float)[..., :, None]).sum(-2)


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the least-squares line through the points x, y (m,)."""
    dx, dy = x - x.mean(), y - y.mean()
    return float((dx * dy).sum() / (dx * dx).sum())


def principal_axes(tensors: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (k, 3), ascending, and right-handed axes (k, 3, 3) in columns of symmetric
    tensors (k, 3, 3).

    Jacobi's rotations in cyclic order (Golub and Van Loan, Matrix Computations, section 8.5). Where
    two moments are equal their axes are any two at right angles; they are made unique by what is
    known: the third axis, or the axes of space.
    """
    tensors = np.asarray(tensors, float)
    moments, axes = _jacobi(tensors)
    order = np.argsort(moments, axis=1, kind="stable")
    moments = np.take_along_axis(moments, order, 1)
    axes = np.take_along_axis(axes, order[:, None, :], 2)
    near = np.diff(moments, axis=1) <= ALIKE * moments[:, 2:]
    low, high = _point(axes[:, :, 0]), _point(axes[:, :, 2])
    lower_alike = (near[:, 0] & ~near[:, 1])[:, None]
    upper_alike = (near[:, 1] & ~near[:, 0])[:, None]
    first = np.where(lower_alike, _beside(high), low)
    second = np.where(upper_alike, _beside(low), np.cross(high, first))
    axes = np.stack([first, second, np.cross(first, second)], axis=2)
    axes[near.all(axis=1)] = np.eye(3)
    return moments, axes


def _jacobi(tensors):
    """Eigenvalues (k, 3) in no order and eigenvectors (k, 3, 3) in columns."""
    a, v = tensors.copy(), np.tile(np.eye(3), (len(tensors), 1, 1))
    size = np.abs(tensors).max(axis=(1, 2), initial=0.0)
    for _ in range(SWEEPS):
        for p, q in _TURNS:
            off = a[:, p, q]
            flat = np.abs(off) <= NOTHING * size
            theta = (a[:, q, q] - a[:, p, p]) / np.where(flat, 1.0, 2.0 * off)
            sign = np.where(theta < 0.0, -1.0, 1.0)
            t = np.where(flat, 0.0, sign / (np.abs(theta) + np.sqrt(theta * theta + 1.0)))
            c = 1.0 / np.sqrt(t * t + 1.0)
            s = t * c
            for m in (a.swapaxes(1, 2), a, v):
                left, right = m[:, :, p].copy(), m[:, :, q].copy()
                m[:, :, p] = c[:, None] * left - s[:, None] * right
                m[:, :, q] = s[:, None] * left + c[:, None] * right
    return np.stack([a[:, k, k] for k in range(3)], axis=1), v


def _point(axis):
    """axis (k, 3) with its largest component positive."""
    largest = np.argmax(np.abs(axis), axis=1)
    sign = np.where(np.take_along_axis(axis, largest[:, None], 1) < 0.0, -1.0, 1.0)
    return axis * sign


def _beside(axis):
    """A unit vector at right angles to axis (k, 3): out of the axis of space that is the furthest
    from it."""
    furthest = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    across = furthest - (furthest * axis).sum(1)[:, None] * axis
    return across / length(across)[:, None]
