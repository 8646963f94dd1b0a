"""The model of readings, and the evidence for a further term, of many data sets at once.

y = what is expected without a term + terms that are held + errors from setting to setting, of
batches and of instruments + noise. All are Gaussian. Of single contacts a level that is free is
expected; of simulated tests what the emulators say at the base model's best point, with what free
coefficients change there and the simulation's own error (`diagnosis.bulk`).

How large the errors are is one of a grid (the prior is half Cauchy in units of a setting's error).
With the inverse covariance P, a curve m gains m'Py - m'Pm / 2 in log probability, and a Gaussian
vector of root V beside it gains u'A^-1 u / 2 - log det(A) / 2 with u = V'P(y - m) and A = 1 + V'PV
(Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, 5.4.1 and A.3).

A term is what one thing that may be missing adds to the logarithms of the readings. It has shapes,
for instance the named forms of a law and its free curve. A shape is a list of hyperparameters, all
alike probable. At each the shape is Gaussian: a curve (`mean`) and what is uncertain about it
(`root` @ N(0, I)). The probability of the data with a term is the average over all of them, so that
many shapes are no advantage (Occam factor: MacKay 2003, Information Theory, Inference, and Learning
Algorithms, chapter 28).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from diagnosis.chance import log_sum
from diagnosis.laws.readings import Readings, unknown
from diagnosis.laws.slots import FreeLaw
from diagnosis.reading_errors import redrawn_share, sizes_of

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
    law: FreeLaw | None = None
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


KnownCurves = Callable[[Readings], list[tuple[tuple, Shape]]]
"""A function of readings that gives [(place, `Shape`)] of the catalogue's mechanisms."""

LEVEL_SD = 1.5  # prior sd of the level's logarithm
OWN_LEVEL = 0.01  # the same where a mechanism has no base coefficient
TIMES = (1.5, 4.0, 12.0, 36.0)
"""Standard deviations of an error that readings share that are tried, in units of the median error
of a setting; and none."""

USUAL = 2.0  # scale of their prior, in the same unit
NONE = 2.0  # prior weight of none, beside a half Cauchy density times its spacing
JITTER = 1e-10
MOST_NAMES = 4  # kinds of error of which two are tried at once


@dataclass(frozen=True)
class Held:
    """A term in the model at the likeliest of its shapes and its strength number k: mean (n,), root
    (n, r), and log prior probability of both."""

    term: Term
    shape: Shape
    k: int
    mean: np.ndarray
    root: np.ndarray
    prior: float


@dataclass(frozen=True)
class Ground:
    """What is expected of n simulated readings before a term is added: mean (n,), root (n, p) of
    what coefficients may change by what is known of them, error (n, n): covariance of the
    simulation's own errors."""

    mean: np.ndarray
    root: np.ndarray
    error: np.ndarray


@dataclass
class Block:
    """Model of `Readings` with the terms that could be added and those that are held {key: Held};
    ground: of simulated readings, None where a level is free; y: (n,) logarithms of the readings.
    """

    readings: Readings
    terms: dict
    held: dict = field(default_factory=dict)
    ground: Ground | None = None

    def __post_init__(self):
        self.y, self.unit = self.readings.log, self.readings.usual
        n = len(self.y)
        self.shared = self.readings.scatters | self.readings.groups
        self.sds = sizes_of(self.shared, TIMES, 2 if len(self.shared) <= MOST_NAMES else 1)
        self.times = {k: np.array([c.get(k, 0.0) for c in self.sds]) for k in self.shared}
        times = np.array([*self.times.values()])
        weight = np.where(times > 0.0, times / (1.0 + (times / USUAL) ** 2), NONE).prod(0)
        self.prior = np.log(weight / weight.sum())
        alike = {name: self._alike(name) for name in self.shared}
        noise = np.diag(self.readings.error**2) + JITTER * np.eye(n)
        own = [noise + sum(t**2 * alike[k] for k, t in c.items()) for c in self.sds]
        self.errors = np.array(own)
        level = Ground(self.readings.centre, np.full((n, 1), LEVEL_SD), np.zeros((n, n)))
        self.start = self.ground or level
        self.mean = sum((h.mean for h in self.held.values()), self.start.mean)
        self.own = sum((h.root @ h.root.T for h in self.held.values()), np.zeros((n, n)))
        self.smooth = self.own + (self.start.root @ self.start.root.T + self.start.error)
        total = self.errors + self.smooth
        self.precision, self.logdet = np.linalg.inv(total), np.linalg.slogdet(total)[1]

    def _alike(self, name):
        """Covariance (n, n) of an error that readings share, at size 1."""
        code = self.shared[name]
        same = (code[:, None] == code) & (code >= 0)
        return np.outer(self.unit, self.unit) * same

    def without(self, key: str) -> "Block":
        """The same without a term, if it is held."""
        if key not in self.held:
            return self
        return replace(self, held={k: h for k, h in self.held.items() if k != key})

    def holding(self, key: str, term: Term | None = None) -> "Block":
        """The same with a term held at its likeliest, its own under that key unless given."""
        return replace(self, held=self.held | {key: self.hold(term or self.terms[key])})

    @cached_property
    def _own_level(self):
        """(precision, log determinant) where the level is known but for OWN_LEVEL."""
        total = self.errors + self.smooth - LEVEL_SD**2 + OWN_LEVEL**2
        return np.linalg.inv(total), np.linalg.slogdet(total)[1]

    def base(self, y: np.ndarray) -> np.ndarray:
        """Log probabilities (g, b) of data sets y (b, n) at each place of the grid, priors
        included."""
        return _density(self.precision, self.logdet, y - self.mean) + self.prior[:, None]

    def evidence(self, term: Term, y: np.ndarray, base: np.ndarray | None = None) -> np.ndarray:
        """Log (b,) of the odds for the model with a term against the one without, its prior
        included."""
        base = self.base(y) if base is None else base
        values = [log_sum(self.gains(s, y, base) + s.weight, axis=(0, 1)) - np.log(len(s.label))
                  for s in term.shapes]  # fmt: skip
        return term.weight + log_sum(values, axis=0) - log_sum(base, axis=0)

    def gains(self, shape: Shape, y: np.ndarray, base: np.ndarray) -> np.ndarray:
        """Log probabilities (g, k, b) with a shape at each of its strengths."""
        z = y - self.mean
        if shape.own_level:
            precision, logdet = self._own_level
            change = _density(precision, logdet, z) + self.prior[:, None]
            return change[:, None] + _gains(shape, precision, z)
        return base[:, None] + _gains(shape, self.precision, z)

    @cached_property
    def here(self) -> np.ndarray:
        """`base` (g, 1) of the readings."""
        return self.base(self.y[None])

    def by_strength(self, shape: Shape) -> np.ndarray:
        """Log probabilities (k,) of the readings with a shape at each of its strengths."""
        values: np.ndarray = log_sum(self.gains(shape, self.y[None], self.here)[:, :, 0], axis=0)
        return values

    def score(self) -> float:
        """Log probability of the readings and of what is held, up to a constant."""
        return float(log_sum(self.here)) + sum(h.prior for h in self.held.values())

    def hold(self, term: Term) -> Held:
        """`Held` of a term at the likeliest of its shapes and strengths."""
        tried = [(self.by_strength(s) + s.weight - np.log(len(s.label)), s) for s in term.shapes]
        value, shape = max(tried, key=lambda one: one[0].max())
        k = int(np.argmax(value))
        prior = term.weight + shape.weight - float(np.log(len(shape.label)))
        mean = np.zeros(len(self.y)) if shape.mean is None else shape.mean[k]
        if not shape.own_level and self.ground is None:
            mean = mean - mean.mean()
        return Held(term, shape, k, mean, shape.root[k], prior)

    def part(self, key: str) -> np.ndarray:
        """Return what a held term adds (n,) to the readings, averaged over the sizes of errors."""
        h = self.held[key]
        pull = self.precision @ (self.y - self.mean)
        return h.mean + (h.root @ (h.root.T @ pull.T)) @ self.shares()

    def part_of(self, key: str) -> tuple[np.ndarray, np.ndarray]:
        """Means and standard deviations (n,) of what a held term without a curve adds beyond what
        the coefficients, or the level, take up of it; over the sizes of errors."""
        root, share, free = self.held[key].root, self.shares(), self.start.root
        weighed = free / self.readings.error[:, None] ** 2
        taken = np.linalg.solve(weighed.T @ free + np.eye(free.shape[1]), weighed.T @ root)
        shown = root - free @ taken
        each = self.precision @ (self.y - self.mean) @ root @ shown.T
        left = np.eye(root.shape[1]) - root.T @ self.precision @ root
        variance = ((shown @ left) * shown).sum(-1)
        mean = share @ each
        return mean, np.sqrt(np.maximum(share @ (variance + each**2) - mean**2, 0.0))

    def strength(self, key: str) -> float:
        """The strength of a held curve, what its root adds to first order counted in."""
        h = self.held[key]
        shape, k = h.shape, h.k
        if shape.mean is None or len(shape.label) < 2:
            return float(shape.label[k])
        pull = self.precision @ (self.y - self.mean)
        u = float((h.root[:, 0] @ pull.T) @ self.shares())
        found = shape.label[k] + 0.5 * u * np.gradient(shape.label)[k]
        return float(np.clip(found, shape.label.min(), shape.label.max()))

    def expected(self, errors: Iterable[str] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Means and variances (n,) of the true values behind the readings, and of what errors of
        these names add to them; others that readings share are left out."""
        own = (self.times[name][:, None, None] ** 2 * self._alike(name) for name in errors)
        smooth, share = sum(own, self.smooth), self.shares()
        fits = self.fitted(smooth)
        cover = smooth - smooth @ self.precision @ smooth
        mean = share @ fits
        own = np.diagonal(cover, axis1=1, axis2=2)
        return mean, np.maximum(share @ (own + fits**2) - mean**2, 0.0)

    def bare(self) -> list[int]:
        """Places of the grid without an error from setting to setting."""
        return [g for g, c in enumerate(self.sds) if not set(c) & set(self.readings.scatters)]

    def chi_square(self, y: np.ndarray, places: Sequence[int] | np.ndarray) -> np.ndarray:
        """(b,) sum of squared residuals of data sets (b, n) in the errors at the likeliest of some
        places of the grid: of `bare`, the readings' own and those of batches and instruments."""
        z, p = y - self.mean, self.precision[places]
        value = self.base(y)[places]
        quadratic = (z * (z @ p)).sum(-1)
        return np.take_along_axis(quadratic, value.argmax(0)[None], 0)[0]

    def fitted(self, smooth: np.ndarray | None = None) -> np.ndarray:
        """Return what the model says (g, n) of the true values behind the readings, at each place
        of the grid; smooth: their covariance, its own unless given."""
        smooth = self.smooth if smooth is None else smooth
        return self.mean + (smooth @ self.precision @ (self.y - self.mean)[:, None])[..., 0]

    def shares(self) -> np.ndarray:
        """Probabilities (g,) of the sizes of the errors."""
        value = self.here[:, 0]
        return np.exp(value - log_sum(value))

    def chance_of(self, name: str) -> float:
        """Probability that an error of readings is there."""
        return float(self.shares() @ (self.times[name] > 0.0))

    def draw(
        self, count: int, rng: np.random.Generator, sizes: np.ndarray | None = None
    ) -> np.ndarray:
        """Data sets (count, n) of what the model says of the readings, errors and noise drawn anew.

        Of single contacts the true values are those that the readings tell; of simulated tests what
        is held is as they have it, and coefficients are drawn anew. How large the errors are is
        drawn from what they say of them, or has the probabilities sizes (g,)."""
        share = self.shares() if sizes is None else sizes
        place = rng.choice(len(share), count, p=share)
        if self.ground is None:
            return self.fitted()[place] + self.noise(place, rng)
        told = self.mean + (self.own @ self.precision @ (self.y - self.mean)[:, None])[..., 0]
        free = rng.standard_normal((count, self.ground.root.shape[1])) @ self.ground.root.T
        return told[place] + free + self.noise(place, rng)

    def noise(self, place: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Errors (count, n) of readings and of a simulation, the shared ones of the sizes at places
        (count,) of the grid; over a spread that the replicates find."""
        error = self.readings.error
        out = rng.standard_normal((len(place), len(error)))
        for g in np.unique(place):
            size, direction = np.linalg.eigh(self.errors[g] - np.diag(error**2) + self.start.error)
            root = direction * np.sqrt(np.maximum(size, 0.0))
            out[place == g] = out[place == g] @ root.T
        own = error * rng.standard_normal(out.shape)
        for kind in self.readings.experiments:
            readings, at = self.readings.of(kind)
            own[:, at] /= redrawn_share(error[at], readings.replicates, len(place), rng)
        return out + own

    def sd_of(self, name: str) -> np.ndarray:
        """Root mean square standard deviations (n,) of an error, over what the readings say of its
        size."""
        size = np.sqrt(self.shares() @ self.times[name] ** 2)
        return self.unit * size * (self.shared[name] >= 0)

    def freedom(self) -> float:
        """Readings less the directions of what is free that they tell."""
        free = self.start.root @ self.start.root.T
        told = np.trace(free @ self.precision[self.bare()[0]])
        return len(self.mean) - round(float(told), 1)


def _density(precision, logdet, z):
    """(g, b) log densities of z (b, n), up to a constant."""
    quadratic = (z * (z @ precision)).sum(-1)
    return -0.5 * (quadratic + logdet[:, None])


def _gains(shape, precision, z):
    """(g, k, b) gains of a shape in the log density of z (b, n)."""
    k, n, r = shape.root.shape
    flat = shape.root.transpose(0, 2, 1).reshape(k * r, n)
    pulled = flat @ precision
    u = (pulled @ z.T).reshape(len(precision), k, r, len(z))
    pulled = pulled.reshape(len(precision), k, r, n)
    if shape.mean is not None:
        u = u - (pulled * shape.mean[:, None]).sum(-1)[..., None]
    a = np.eye(r) + pulled @ shape.root
    if r == 1:
        out = 0.5 * u[:, :, 0] ** 2 / a[..., 0] - 0.5 * np.log(a[..., 0])
    else:
        out = 0.5 * (u * (np.linalg.inv(a) @ u)).sum(2) - 0.5 * np.linalg.slogdet(a)[1][..., None]
    if shape.mean is not None:
        mean = shape.mean @ precision
        out += mean @ z.T - 0.5 * (mean * shape.mean).sum(-1)[..., None]
    return out


LEAST_LEVELS = 3  # of a lever, to leave one out or to tell a scatter


def refitted(block: Block, index: np.ndarray) -> Block:
    """The block without the readings `index`, the strengths of what is held fitted anew, each in
    its form: the levels that are left may be too few to choose one. index: (k,) places of
    readings."""
    out = replace(block, readings=unknown(block.readings, index))
    for key in block.held:
        form = replace(block.terms[key], shapes=(block.held[key].shape,))
        out = out.without(key).holding(key, form)
    return out


def levels_of(block: Block, law: FreeLaw | None) -> tuple[str | None, list[np.ndarray]]:
    """(lever, [indices]) of the levels to be left out together: of the lever that a law acts on, or
    of its covariate in thirds; single settings where it has too few."""
    readings = block.readings
    for name in law.needs if law else ():
        if len(readings.folds.get(name, ())) >= LEAST_LEVELS:
            return name, readings.folds[name]
        if name in readings.covariates:
            order = np.argsort(readings.covariates[name], kind="stable")
            return name, np.array_split(order, min(4, len(order)))
    return None, [np.array([i]) for i in range(len(readings.log))]


def judged(block: Block, key: str) -> dict[str, Any]:
    """{settings, before, after, beyond_band}: how left-out inner levels are missed (root mean
    square) without and with a law, in errors of the readings, and in all errors with it."""
    law, readings = block.terms[key].law, block.readings
    lever, levels = levels_of(block, law)
    inner = levels[1:-1] if lever else levels
    # nothing but its own readings tells a level that was set wrongly
    wrong = [h.root.any(1) for h in block.held.values() if h.term.what == "one level"]
    inner = [index for index in inner if not any(w[index].any() for w in wrong)]
    rows = [np.zeros((3, 0))]
    for index in inner:
        held, error = refitted(block, index), readings.error[index]
        (_, bare, _), (_, off, sd) = (
            _missed(b, readings, index, block.shared) for b in (held.without(key), held)
        )
        rows.append(np.array([bare / error, off / error, off / sd]))
    misses = np.hstack(rows)
    count = misses.shape[1]
    sizes = np.sqrt((misses**2).sum(1) / max(count, 1)).tolist()
    return {"settings": count} | dict(zip(("before", "after", "beyond_band"), sizes, strict=True))


def _missed(block, known, index, names):
    """(expected logarithms, how far readings are off, standard deviations of that), of those at
    `index`, which a block does not know; known: `Readings` with their errors; names: of the errors
    that count beside."""
    mean, variance = (v[index] for v in block.expected())
    shared = sum(block.sd_of(name)[index] ** 2 for name in names)
    return mean, known.log[index] - mean, np.sqrt(known.error[index] ** 2 + variance + shared)


def without_row(block: Block, key: str, place: int) -> tuple[float, float]:
    """(distance [sd], expected logarithm) of a row from what all others say."""
    rest = refitted(block.without(key), np.array([place]))
    mean, off, sd = _missed(rest, block.readings, place, block.readings.scatters)
    return float(off / sd), float(mean)
