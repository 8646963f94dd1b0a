"""A term of the model: what one thing that may be missing adds to the logarithms of the readings.

A term has shapes, for instance the named forms of a law and its free curve. A shape is a list of
hyperparameters, all alike probable. At each the shape is Gaussian: a curve (`mean`) and what is
uncertain about it (`root` @ N(0, I)). The probability of the data with a term is the average over
all of them, so that many shapes are no advantage (Occam factor: MacKay 2003, Information Theory,
Inference, and Learning Algorithms, chapter 28).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

SIZES = np.geomspace(0.005, 1.5, 11)
"""Standard deviations of a random term that are tried, of a logarithm, all alike probable."""

LAW, ERROR, ROW = "law", "error", "row"


@dataclass(frozen=True)
class Shape:
    """One form of a term of n readings.

    label: (k,) strengths; root: (k, n, r) roots of covariances; mean: (k, n) curves, None for none;
    weight: log prior probability of the shape among those of its term; own_level: whether the
    curve has the level of the reading in it, so that no coefficient is free.
    """

    name: str
    label: np.ndarray
    root: np.ndarray
    mean: np.ndarray | None = None
    weight: float = 0.0
    catalogue: bool = False
    own_level: bool = False


@dataclass(frozen=True)
class Term:
    """One thing that may be missing in an experiment.

    kind: LAW, ERROR or ROW; key: unique in its experiment; weight: log prior odds against a law;
    law: the `FreeLaw`, or None; place: (slot, state) of a law; of: what an error is of; what: which
    error of that; rows: places of single readings; more: what else the verdict tells of it.
    """

    experiment: str
    kind: str
    key: str
    shapes: tuple
    weight: float = 0.0
    law: object = None
    place: tuple = ()
    of: str = ""
    what: str = ""
    rows: tuple = ()
    more: dict = field(default_factory=dict)

    @property
    def free(self) -> bool:
        """Return whether it has other shapes than mechanisms of the catalogue."""
        return any(not s.catalogue for s in self.shapes)


def random_term(
    root: np.ndarray, name: str = "", sizes: np.ndarray = SIZES, weight: float = 0.0
) -> Shape:
    """`Shape` of root (n, r) times each of the sizes."""
    return Shape(name, np.asarray(sizes), sizes[:, None, None] * root[None], weight=weight)


def curve_shape(name: str, label: ArrayLike, curves: np.ndarray, **more: Any) -> Shape:
    """`Shape` of curves (k, n) at ascending or descending strengths (k,): between two of them the
    strength is uncertain, to first order."""
    root = 0.5 * np.gradient(curves, axis=0)[..., None] if len(curves) > 1 else curves[..., None]
    return Shape(name, np.asarray(label), root, curves, **more)
