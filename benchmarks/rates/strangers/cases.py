"""Tables with what is true of them: laws, faults of the laboratory, and nulls.

A case is fixed by its kind, its strength and its seed. The strength is the largest distance of a
setting from the best constant coefficient, in standard errors of the setting, with no noise drawn.
A law keeps its own size, and the noise of a reading is set to reach the strength; a fault of the
laboratory is made as large as the strength asks at the usual noise.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from benchmarks.rates.strangers import nature, plans

RELATIVE, DEGREES, REPLICATES = 0.02, 0.4, 5
"""Usual noise of one reading: a share of a rebound or a stress, degrees of an angle; readings of a
setting."""

MOST = 4.0
"""Times the usual noise: no laboratory reads worse than that."""

PROPORTIONAL = {
    name: own["proportional"] for name, own in plans.EXPERIMENTS.items() if "proportional" in own
}
"""Lever that a reading goes with at a constant coefficient."""


@dataclass(frozen=True)
class Fault:
    """What the laboratory did wrong.

    of: a lever, batch, instrument, order, resolution or settings, as in errors of verdict.json, or
    row.
    lines: of the file, 1 is its header; of the faulty rows, or of the rows of the faulty level.
    """

    experiment: str
    of: str
    lines: tuple[int, ...] = ()


@dataclass
class Drawn:
    """A table and what is true of it: the laws at their strengths, a fault, and of each experiment
    of a table with laws the constant, its restitution or friction."""

    table: pd.DataFrame
    laws: Sequence[nature.Law] = ()
    fault: Fault | None = None
    constants: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """kind, strength and seed fix the table. group: what the score counts it under, a key of
    kinds.yaml."""

    kind: str
    strength: float
    seed: int

    @property
    def name(self) -> str:
        return f"{self.kind.replace(' ', '_')}@{self.strength:g}#{self.seed}"

    @property
    def group(self) -> str:
        return KINDS[self.kind][0]

    def draw(self) -> Drawn:
        """The table; equal for equal cases on every machine."""
        rng = np.random.default_rng([self.seed, zlib.crc32(self.kind.encode())])
        while True:
            drawn = KINDS[self.kind][1](rng, self.strength)
            # no laboratory writes down a rebound above its drop
            if not (drawn.table["value"] >= drawn.table.get("drop_height_mm", np.inf)).any():
                return drawn


# --- readings ---------------------------------------------------------------------------------


def sigma(experiment, true, scale=1.0):
    """Standard deviation of one reading (n,)."""
    return scale * (RELATIVE * true if experiment in PROPORTIONAL else DEGREES + 0.0 * true)


def distance(experiment, x, true):
    """Largest distance of a setting from the best constant coefficient, in standard errors of a
    mean at the usual noise."""
    error = sigma(experiment, true) / np.sqrt(REPLICATES)
    shape = x[PROPORTIONAL[experiment]] if experiment in PROPORTIONAL else np.ones(len(true))
    best = (shape * true / error**2).sum() / (shape**2 / error**2).sum()
    return float(np.abs((true - best * shape) / error).max())


def means(experiment, x, true, rng, scale=1.0, tails=False, read=None):
    """Rows that are means of replicates.

    scale: of the usual noise. tails: readings of Student's t with three degrees of freedom. read:
    what an eye makes of a reading.
    """
    shape = (len(true), REPLICATES)
    draws = rng.standard_t(3, shape) / np.sqrt(3.0) if tails else rng.standard_normal(shape)
    readings = true[:, None] + sigma(experiment, true, scale)[:, None] * draws
    readings = read(readings) if read else readings
    return _rows(experiment, x, readings.mean(1)).assign(sd=readings.std(1, ddof=1), n=REPLICATES)


def singles(experiment, x, true, rng, scale=1.0, read=None):
    """Rows that are single readings, five of each setting, named by `replicate`."""
    many = {k: np.repeat(v, REPLICATES) for k, v in x.items()}
    true = np.repeat(true, REPLICATES)
    values = true + sigma(experiment, true, scale) * rng.standard_normal(len(true))
    table = _rows(experiment, many, read(values) if read else values)
    return table.assign(
        replicate=np.tile(np.arange(1, REPLICATES + 1), len(x["particle_diameter_mm"]))
    )


def a_reading_a_day(experiment, x, true, rng, scale=1.0):
    """Rows that are single readings, one of each setting on each of five declared days; what a day
    adds has twice the spread of a reading."""
    table = singles(experiment, x, true, rng, scale).rename(columns={"replicate": "batch"})
    off = 2.0 * rng.standard_normal(REPLICATES)[table["batch"] - 1]
    added = off * sigma(experiment, np.repeat(true, REPLICATES), scale)
    return table.assign(value=table["value"] + added)


WRITTEN: dict[str, Callable[..., pd.DataFrame]] = {
    "means": means,
    "means_with_tails": partial(means, tails=True),
    "singles": singles,
    "a_reading_a_day": a_reading_a_day,
}
"""What a laboratory writes down."""


def _rows(experiment, x, values):
    own = plans.EXPERIMENTS[experiment]
    head = {"experiment": experiment, "quantity": own["quantity"], "value": values}
    head |= {"unit": own["unit"]}
    return pd.DataFrame(head | dict(x))


def constant(experiment, rng):
    """A restitution or a friction."""
    return float(rng.uniform(0.5, 0.8) if experiment == "drop" else rng.uniform(0.3, 0.7))


# --- laws -------------------------------------------------------------------------------------


def noise_for(laws, experiment, x, c, strength):
    """Scale of the usual noise at which the weakest of the laws of an experiment, each alone, is so
    strong; MOST at most, and the law is then stronger than asked."""
    own = [law for law in laws if law.experiment == experiment]
    alone = [distance(experiment, x, nature.value([law], experiment, x, c)) for law in own]
    return min(min(alone) / strength, MOST) if alone else 1.0


def with_laws(
    rng, strength, laws=(), beside=(), plan="4", column=None, uneven=False, written="means"
):
    """A table with these laws of `nature.BY_NAME`; without one, a null.

    beside: further experiments, without one. column: a further column without any effect. uneven:
    each setting is read half as well, as well or twice as well as usual. written: of WRITTEN.
    """
    laws = [nature.BY_NAME[name] for name in laws]
    laws = [law if "v^" in law.name else replace(law, k=law.k * rng.uniform(0.85, 1.15))
            for law in laws]  # fmt: skip
    parts, constants = [], {}
    for experiment in dict.fromkeys([*(law.experiment for law in laws), *beside]):
        states = {s for law in laws if law.experiment == experiment
                  for _, place in law.places for s in place}  # fmt: skip
        further = next((c for c in plans.FURTHER if c in states), column)
        x = plans.levers(experiment, plan, rng, further, "interval" in states)
        c = constants[experiment] = constant(experiment, rng)
        noise = noise_for(laws, experiment, x, c, strength)
        true = nature.value(laws, experiment, x, c)
        scale = rng.choice([0.5, 1.0, 2.0], len(true)) if uneven else noise
        parts.append(WRITTEN[written](experiment, x, true, rng, scale))
    return Drawn(pd.concat(parts, ignore_index=True), laws, None, constants)


# --- faults of the laboratory -------------------------------------------------------------------


def _plain(experiment, plan, rng, shuffle=False):
    x = plans.levers(experiment, plan, rng)
    if shuffle:  # the rows in the order in which they were measured
        order = rng.permutation(len(x["particle_diameter_mm"]))
        x = {k: v[order] for k, v in x.items()}
    return x, nature.value((), experiment, x, constant(experiment, rng))


def _faulty(table, *fault, other=None, plan="4", rng=None):
    """A table with a fault, and rows of another experiment without one."""
    beside = [means(other, *_plain(other, plan, rng), rng)] if other else []
    return Drawn(pd.concat([table, *beside], ignore_index=True), fault=Fault(*fault))


def grown(experiment, x, true, pattern, strength):
    """True readings with a pattern (n,) of standard errors added, as strong as asked."""
    error = sigma(experiment, true) / np.sqrt(REPLICATES)
    k = strength / max(distance(experiment, x, true + error * pattern), 1e-9)
    for _ in range(30):  # the error of a rebound goes with the rebound
        k *= strength / distance(experiment, x, true + error * pattern * k)
    return true + error * pattern * k


def patterned(rng, strength, experiment, plain, errors, of, columns=None, **beside):
    """Readings of a plan (`_plain`) have errors (n,) in common, in standard errors, and further
    columns. of: what the fault is of."""
    x, true = plain
    table = means(experiment, x, grown(experiment, x, true, errors, strength), rng)
    return _faulty(table.assign(**columns or {}), experiment, of, rng=rng, **beside)


def shared_by_level(rng, strength, experiment, of, plan="4", other=None):
    """All readings at a level of a lever share an error."""
    plain = _plain(experiment, plan, rng)
    level = np.unique(plain[0][of], return_inverse=True)[1]
    errors = _uneven(level.max() + 1, rng)[level]
    return patterned(rng, strength, experiment, plain, errors, of, other=other, plan=plan)


def _uneven(n, rng):
    """Errors of n levels that no smooth curve has: neighbours alternate where there are three and
    more."""
    if n < 3:
        return rng.choice([-1.0, 1.0]) * np.array([1.0, -1.0])[:n]
    return rng.uniform(0.6, 1.4, n) * (-1.0) ** np.arange(n) * rng.choice([-1.0, 1.0])


def shared_by_column(rng, strength, experiment, of, count, told=True):
    """Readings of a batch, or of an instrument, share an error; the column `of` tells which, or is
    not there."""
    plain = _plain(experiment, "4", rng)
    group = rng.permutation(np.arange(len(plain[1])) % count)
    words = group + 1 if of == "batch" else np.array(["video", "sound"])[group]
    errors = _uneven(count, rng)[group]
    # an undeclared batch in random order is nothing but scatter from setting to setting
    of, columns = (of, {of: words}) if told else ("settings", {})
    return patterned(rng, strength, experiment, plain, errors, of, columns)


def scatter(rng, strength, experiment):
    """Each setting has an error of its own."""
    plain = _plain(experiment, "4", rng)
    errors = rng.standard_normal(len(plain[1]))
    return patterned(rng, strength, experiment, plain, errors, "settings")


def drift(rng, strength, experiment, shuffle=False):
    """The plate wears in the order of the rows; the plan is measured level by level, or in random
    order."""
    plain = _plain(experiment, "4", rng, shuffle)
    errors = -np.linspace(0.0, 1.0, len(plain[1]))
    return patterned(rng, strength, experiment, plain, errors, "order")


def one_row(rng, strength, experiment, plan="4", other=None, written="means"):
    """One row is off by so many standard errors; of single readings, by so many standard deviations
    of a reading."""
    x, true = _plain(experiment, plan, rng)
    table = WRITTEN[written](experiment, x, true, rng)
    row = int(rng.integers(len(table)))
    spread = sigma(experiment, true)[row * len(true) // len(table)]
    error = spread / np.sqrt(REPLICATES) if written == "means" else spread
    table.loc[row, "value"] += strength * error * rng.choice([-1.0, 1.0])
    return _faulty(table, experiment, "row", (row + 2,), other=other, plan=plan, rng=rng)


def mislabelled(rng, strength):
    """Three of 20 rows at three sizes and three neighbouring heights stand under each other's
    label, none above the height that it stands under. The strength does not count."""
    x = plans.levers("drop", "close", rng)
    table = means("drop", x, nature.value((), "drop", x, float(rng.uniform(0.5, 0.7))), rng)
    heights = np.unique(x["drop_height_mm"])
    sizes = rng.permutation(np.unique(x["particle_diameter_mm"]))[:3]
    start = int(rng.integers(len(heights) - 2))
    rows = [
        int(np.flatnonzero((x["drop_height_mm"] == h) & (x["particle_diameter_mm"] == d))[0])
        for h, d in zip(heights[start : start + 3], sizes, strict=True)
    ]
    read = ["value", "sd"]
    table.loc[rows, read] = table.loc[np.roll(rows, 1), read].to_numpy()
    return _faulty(table, "drop", "row", tuple(sorted(r + 2 for r in rows)))


def wrong_level(rng, strength, share, level=2):
    """All drops of one level fell from a height that was so many times the one that stands in the
    table (120 mm that were 132). The noise makes it as strong as asked."""
    x, true = _plain("drop", "5", rng)
    at = x["drop_height_mm"] == np.unique(x["drop_height_mm"])[level]
    off = true * np.where(at, share, 1.0)
    scale = distance("drop", x, off) / strength
    lines = tuple(int(i) + 2 for i in np.flatnonzero(at))
    return _faulty(means("drop", x, off, rng, scale), "drop", "drop_height_mm", lines)


def coarse(rng, strength, to_mm, every_reading, written="means"):
    """Rebounds are read to so many mm: each reading, or the mean that is written down."""

    def read(values):
        return np.maximum(np.round(values / to_mm), 1.0) * to_mm

    eye = read if every_reading else None
    table = WRITTEN[written]("drop", *_plain("drop", "5", rng), rng, read=eye)
    if "sd" in table:  # five equal readings do not have a spread of nothing
        table["sd"] = np.maximum(table["sd"], to_mm / np.sqrt(12.0) * every_reading)
    if not every_reading:
        table["value"] = read(table["value"])
    return _faulty(table, "drop", "resolution")


def named_batches(rng, strength, column, count):
    """Batches or instruments that are told and share nothing."""
    table = means("drop", *_plain("drop", "4", rng), rng)
    table[column] = rng.permutation(np.arange(len(table)) % count) + 1
    return Drawn(table)


# --- the kinds and the campaign -----------------------------------------------------------------


DRAWS: dict[str, Callable[..., Drawn]] = {
    draw.__name__: draw
    for draw in (
        with_laws, shared_by_level, shared_by_column, scatter, drift, one_row, mislabelled,
        wrong_level, coarse, named_batches,
    )
}  # fmt: skip


def _read(name):
    return yaml.safe_load(Path(__file__).with_name(name).read_text())


def _draw(name, draw="with_laws", **how):
    own = {"laws": [name]} if name in nature.BY_NAME else {}
    return partial(DRAWS[draw], **own, **how)


KINDS: dict[str, tuple[str, Callable[..., Drawn]]] = {
    name: (group, _draw(name, **how))
    for group, kinds in _read("kinds.yaml").items()
    for name, how in kinds.items()
}
PLANNED: dict[str, Any] = _read("campaign.yaml")
FIRST_SEED = 1500
"""Seeds from here on were drawn for the campaign alone."""

ROUNDS = 4


def campaign() -> list[Case]:
    """Every case, fixed beforehand; each of the rounds has a like share of every group, in an order
    that mixes the groups, so that a part of them is a fair sample."""
    nulls = {group: [(0, seed) for seed in range(n)] for group, n in PLANNED["nulls"].items()}
    asked = PLANNED["campaign"] | nulls
    each = {group: -(-len(of) // ROUNDS) for group, of in asked.items()}
    all_of = [
        (k // each[group], Case(name, float(size), FIRST_SEED + seed))
        for name, (group, _) in KINDS.items()
        for k, (size, seed) in enumerate(asked[group])
    ]
    return [c for _, c in sorted(all_of, key=lambda c: (c[0], zlib.crc32(c[1].name.encode())))]
