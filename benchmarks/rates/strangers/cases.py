"""Tables with what is true of them: laws, faults of the laboratory, and nulls.

A case is fixed by its kind, its strength and its seed. The strength is the largest distance of a
setting from the best constant coefficient, in standard errors of the setting, with no noise drawn.
A law keeps its own size, and the noise of a reading is set to reach the strength; a fault of the
laboratory is made as large as the strength asks at the usual noise.
"""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd

from benchmarks.rates.strangers import nature, plans

RELATIVE, DEGREES, REPLICATES = 0.02, 0.4, 5
"""Usual noise of one reading: a share of a rebound or a stress, degrees of an angle; readings of a
setting."""

MOST = 4.0
"""Times the usual noise: no laboratory reads worse than that."""

QUANTITY = {
    "drop": ("rebound_height", "mm"),
    "tilt": ("sliding_angle", "deg"),
    "shear": ("shear_stress", "kPa"),
}
PROPORTIONAL = {"drop": "drop_height_mm", "shear": "normal_stress_kPa"}
"""Lever that a reading goes with at a constant coefficient."""

PLANS = {"2": (2, 4), "3": (3, 3), "4": (4, 4), "5": (5, 4), "2x2": (2, 2), "close": ("close", 5)}
"""How many heights or rates, and how many sizes."""


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
    """A table and what is true of it.

    strong: the laws with their strengths. Of each experiment of a table with laws, constants: the
    restitution or friction; noise: of a reading, times the usual.
    """

    table: pd.DataFrame
    laws: tuple[nature.Law, ...] = ()
    faults: tuple[Fault, ...] = ()
    constants: dict = field(default_factory=dict)
    noise: dict = field(default_factory=dict)
    strong: tuple[tuple[nature.Law, float], ...] = ()


@dataclass(frozen=True)
class Case:
    """kind, strength and seed fix the table. group: what the score counts it under."""

    kind: str
    strength: float
    seed: int

    @property
    def name(self) -> str:
        return f"{self.kind.replace(' ', '_')}@{self.strength:g}#{self.seed}"

    @property
    def group(self) -> str:
        return KINDS[self.kind].group

    def draw(self) -> Drawn:
        """The table; equal for equal cases on every machine."""
        rng = np.random.default_rng([self.seed, zlib.crc32(self.kind.encode())])
        drawn = KINDS[self.kind].draw(rng, self.strength)
        while _above_its_drop(drawn.table):  # no laboratory writes that down
            drawn = KINDS[self.kind].draw(rng, self.strength)
        return drawn


def _above_its_drop(table):
    return "drop_height_mm" in table and (table["value"] >= table["drop_height_mm"]).any()


@dataclass(frozen=True)
class Kind:
    """group: law, two laws, two-level law, row, level, fault, two-level error, null or declared."""

    group: str
    draw: Callable


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


def _rows(experiment, x, values):
    quantity, unit = QUANTITY[experiment]
    head = {"experiment": experiment, "quantity": quantity, "value": values, "unit": unit}
    return pd.DataFrame(head | dict(x))


def constant(experiment, rng):
    """A restitution or a friction."""
    return float(rng.uniform(0.5, 0.8) if experiment == "drop" else rng.uniform(0.3, 0.7))


# --- laws -------------------------------------------------------------------------------------


def drawing(function):
    """A function of (rng, strength, how) as one of how, which gives a function of rng and
    strength."""
    return lambda *how, **named: lambda rng, strength: function(rng, strength, *how, **named)


def noise_for(laws, experiment, x, c, strength):
    """Scale of the usual noise at which the weakest of the laws of an experiment, each alone, is so
    strong; MOST at most, and the law is then stronger than asked."""
    own = [(law, k) for law, k in laws if law.experiment == experiment]
    alone = [distance(experiment, x, nature.value((one,), experiment, x, c)) for one in own]
    return min(min(alone) / strength, MOST) if alone else 1.0


@drawing
def with_laws(rng, strength, *names, beside=(), plan="4", column=None, uneven=False, written=means):
    """A table with these laws.

    beside: further experiments, without one. column: a further column without any effect. uneven:
    each setting is read half as well, as well or twice as well as usual.
    """
    laws = tuple(nature.BY_NAME[n] for n in names)
    strong = tuple((law, law.k * rng.uniform(0.85, 1.15) if "v^" not in law.name else law.k)
                   for law in laws)  # fmt: skip
    parts, noise, constants = [], {}, {}
    for experiment in dict.fromkeys([*(law.experiment for law in laws), *beside]):
        states = {s for law in laws if law.experiment == experiment
                  for _, place in law.places for s in place}  # fmt: skip
        further = next((c for c in plans.FURTHER if c in states), column)
        x = plans.levers(experiment, PLANS[plan], rng, further, "interval" in states)
        c = constant(experiment, rng)
        noise[experiment] = noise_for(strong, experiment, x, c, strength)
        constants[experiment] = c
        true = nature.value(strong, experiment, x, c)
        scale = rng.choice([0.5, 1.0, 2.0], len(true)) if uneven else noise[experiment]
        parts.append(written(experiment, x, true, rng, scale))
    table = pd.concat(parts, ignore_index=True)
    return Drawn(table, laws, (), constants, noise, strong)


# --- faults of the laboratory -------------------------------------------------------------------


def _plain(experiment, plan, rng, shuffle=False):
    x = plans.levers(experiment, PLANS[plan], rng)
    if shuffle:  # the rows in the order in which they were measured
        order = rng.permutation(len(x["particle_diameter_mm"]))
        x = {k: v[order] for k, v in x.items()}
    return x, nature.value((), experiment, x, constant(experiment, rng))


def _faulty(table, *fault, other=None, plan="4", rng=None):
    """A table with a fault, and rows of another experiment without one."""
    beside = [means(other, *_plain(other, plan, rng), rng)] if other else []
    return Drawn(pd.concat([table, *beside], ignore_index=True), faults=(Fault(*fault),))


def grown(experiment, x, true, pattern, strength):
    """True readings with a pattern (n,) of standard errors added, as strong as asked."""
    error = sigma(experiment, true) / np.sqrt(REPLICATES)
    k = strength / max(distance(experiment, x, true + error * pattern), 1e-9)
    for _ in range(30):  # the error of a rebound goes with the rebound
        k *= strength / distance(experiment, x, true + error * pattern * k)
    return true + error * pattern * k


@drawing
def patterned(rng, strength, experiment, of, pattern, plan="4", other=None, shuffle=False):
    """Readings of a plan have errors in common: pattern(n, x, rng) gives them in standard errors
    (n,), and further columns. of: what the fault is of. shuffle: the plan is measured in random
    order."""
    x, true = _plain(experiment, plan, rng, shuffle)
    errors, columns = pattern(len(true), x, rng)
    table = means(experiment, x, grown(experiment, x, true, errors, strength), rng)
    return _faulty(table.assign(**columns), experiment, of, other=other, plan=plan, rng=rng)


def shared_by_level(experiment, of, plan="4", other=None):
    """All readings at a level of a lever share an error: a camera set up anew for each height, a
    lot of grains for each size, a plate cleaned for each rate."""

    def pattern(n, x, rng):
        level = np.unique(x[of], return_inverse=True)[1]
        return _uneven(level.max() + 1, rng)[level], {}

    return patterned(experiment, of, pattern, plan, other)


def _uneven(n, rng):
    """Errors of n levels that no smooth curve has: neighbours alternate where there are three and
    more."""
    if n < 3:
        return rng.choice([-1.0, 1.0]) * np.array([1.0, -1.0])[:n]
    return rng.uniform(0.6, 1.4, n) * (-1.0) ** np.arange(n) * rng.choice([-1.0, 1.0])


def shared_by_column(experiment, column, count, declared):
    """Readings of a batch, or of an instrument, share an error; the column tells which, or is not
    there."""

    def pattern(n, x, rng):
        group = rng.permutation(np.arange(n) % count)
        words = group + 1 if column == "batch" else np.array(["video", "sound"])[group]
        return _uneven(count, rng)[group], {column: words} if declared else {}

    # an undeclared batch in random order is nothing but scatter from setting to setting
    return patterned(experiment, column if declared else "settings", pattern)


def scatter(experiment):
    """Each setting has an error of its own."""
    return patterned(experiment, "settings", lambda n, x, rng: (rng.standard_normal(n), {}))


def drift(experiment, shuffle=True):
    """The plate wears in the order of the rows; the plan is measured in random order, or level by
    level."""
    return patterned(
        experiment, "order", lambda n, *_: (-np.linspace(0.0, 1.0, n), {}), shuffle=shuffle
    )


@drawing
def one_row(rng, strength, experiment, plan="4", other=None, written=means):
    """One row is off by so many standard errors; of single readings, by so many standard deviations
    of a reading."""
    x, true = _plain(experiment, plan, rng)
    table = written(experiment, x, true, rng)
    row = int(rng.integers(len(table)))
    spread = sigma(experiment, true)[row * len(true) // len(table)]
    error = spread / np.sqrt(REPLICATES) if written is means else spread
    table.loc[row, "value"] += strength * error * rng.choice([-1.0, 1.0])
    return _faulty(table, experiment, "row", (row + 2,), other=other, plan=plan, rng=rng)


@drawing
def mislabelled(rng, strength):
    """Three of 20 rows at three sizes and three neighbouring heights stand under each other's
    label, none above the height that it stands under. The strength does not count."""
    x = plans.levers("drop", PLANS["close"], rng)
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


@drawing
def wrong_level(rng, strength, share, level=2):
    """All drops of one level fell from a height that was so many times the one that stands in the
    table (120 mm that were 132). The noise makes it as strong as asked."""
    x, true = _plain("drop", "5", rng)
    at = x["drop_height_mm"] == np.unique(x["drop_height_mm"])[level]
    off = true * np.where(at, share, 1.0)
    scale = distance("drop", x, off) / strength
    lines = tuple(int(i) + 2 for i in np.flatnonzero(at))
    return _faulty(means("drop", x, off, rng, scale), "drop", "drop_height_mm", lines)


@drawing
def coarse(rng, strength, to_mm, every_reading, written=means):
    """Rebounds are read to so many mm: each reading, or the mean that is written down."""

    def read(values):
        return np.maximum(np.round(values / to_mm), 1.0) * to_mm

    table = written("drop", *_plain("drop", "5", rng), rng, read=read if every_reading else None)
    if "sd" in table:  # five equal readings do not have a spread of nothing
        table["sd"] = np.maximum(table["sd"], to_mm / np.sqrt(12.0) * every_reading)
    if not every_reading:
        table["value"] = read(table["value"])
    return _faulty(table, "drop", "resolution")


# --- nulls --------------------------------------------------------------------------------------


def null(*experiments, **how):
    """Constant coefficients and noise alone; how: as of `with_laws`."""
    return with_laws(beside=experiments, **how)


@drawing
def named_batches(rng, strength, column, count):
    """Batches or instruments that are told and share nothing."""
    table = means("drop", *_plain("drop", "4", rng), rng)
    table[column] = rng.permutation(np.arange(len(table)) % count) + 1
    return Drawn(table)


KINDS: dict[str, Kind] = {}


def _add(group, draw_of):
    KINDS.update({name: Kind(group, draw) for name, draw in draw_of.items()})


_add("law", {
    **{name: with_laws(name) for name in (
        "fifth root of speed", "sticking speed", "film of liquid", "air",
        "pull of the plate, drops", "wrong zero of the rebound", "top of the grain is read",
        "apex between two frames", "wear by impacts", "friction over log of the rate",
        "friction over the load", "pull of the plate, slides", "lid that was not weighed",
    )},
    **{name: with_laws(name, plan="3") for name in (
        "rises with speed", "rebound 14 % lower at 4 mm", "humidity, drops", "temperature, drops",
        "friction rises with size", "humidity, slides",
    )},
    **{name: with_laws(name, plan="5") for name in (
        "yielding above a speed", "film on the grains below 2 mm", "wear of large grains alone",
        "seen after a slip", "pull, and an added mass", "friction falls with the load",
    )},
    "v^-0.1, 4 levels": with_laws("v^-0.1"),
    "v^-0.2, 5 levels": with_laws("v^-0.2", plan="5"),
    "v^-0.25, 4 levels": with_laws("v^-0.25"),
    "v^-0.3, 3 levels": with_laws("v^-0.3", plan="3"),
    "v^-0.45, 4 levels": with_laws("v^-0.45"),
    "v^-0.6, 3 levels": with_laws("v^-0.6", plan="3"),
    "v^-0.6, 4 levels": with_laws("v^-0.6"),
    "v^-0.25, single readings": with_laws("v^-0.25", plan="3", written=singles),
    "v^-0.25 and constant slides": with_laws("v^-0.25", beside=["tilt"]),
    "power of size, 3 levels": with_laws("power of size", plan="3"),
    "rebound 14 % lower at 4 mm and constant slides":
        with_laws("rebound 14 % lower at 4 mm", plan="3", beside=["tilt"]),
    "late hand, 4 levels": with_laws("late hand"),
    "friction over the load, 3 levels": with_laws("friction over the load", plan="3"),
    "late hand and constant drops": with_laws("late hand", beside=["drop"]),
    "cohesion, 5 loads": with_laws("cohesion", plan="5"),
    "cohesion, 3 loads": with_laws("cohesion", plan="3"),
})  # fmt: skip
_add("two laws", {
    "v^-0.25 and late hand": with_laws("v^-0.25", "late hand"),
    "v^-0.3 and friction over the load": with_laws("v^-0.3", "friction over the load"),
    "power of size and late hand": with_laws("power of size", "late hand"),
    "air and friction over the load": with_laws("air", "friction over the load", plan="5"),
    "fifth root of speed and friction rises with size":
        with_laws("fifth root of speed", "friction rises with size"),
    "v^-0.25 and power of size": with_laws("v^-0.25", "power of size"),
    "late hand and friction over the load": with_laws("late hand", "friction over the load"),
    "humidity and late hand": with_laws("humidity, drops", "late hand"),
    "v^-0.25 and cohesion": with_laws("v^-0.25", "cohesion", plan="5"),
})  # fmt: skip
_add("two-level law", {
    "v^-0.25, 2 heights": with_laws("v^-0.25", plan="2"),
    "late hand, 2 rates": with_laws("late hand", plan="2"),
})  # fmt: skip
_add("row", {
    "one row, drops": one_row("drop"),
    "one row, slides": one_row("tilt"),
    "one row of 9, drops": one_row("drop", "3"),
    "one row, both": one_row("drop", other="tilt"),
    "one single reading": one_row("drop", "3", written=singles),
    "three rows mislabelled": mislabelled(),
})  # fmt: skip
_add("level", {
    "132 mm for 120": wrong_level(1.1),
    "an end that was 12 % higher": wrong_level(1.12, level=4),
    "the first height 10 % lower": wrong_level(0.9, level=0),
})  # fmt: skip
_add("fault", {
    "camera set up for each height": shared_by_level("drop", "drop_height_mm", "5"),
    "camera set up for each of 4 heights": shared_by_level("drop", "drop_height_mm", "4", "tilt"),
    "a lot for each size": shared_by_level("drop", "particle_diameter_mm", "4"),
    "plate cleaned for each rate": shared_by_level("tilt", "tilt_rate_deg_s", "5"),
    "undeclared batches": shared_by_column("drop", "batch", 4, False),
    "undeclared instruments": shared_by_column("drop", "instrument", 2, False),
    "error from setting to setting": scatter("drop"),
    "error from slide to slide": scatter("tilt"),
    "wear in random order": drift("drop"),
    "wear in random order, slides": drift("tilt"),
    "wear in the order of the heights": drift("drop", shuffle=False),
    "means written to 5 mm": coarse(5.0, False),
    "readings to 5 mm": coarse(5.0, True),
    "single readings to 5 mm": coarse(5.0, True, singles),
})  # fmt: skip
_add("two-level error", {
    "error between two tilt rates": shared_by_level("tilt", "tilt_rate_deg_s", "2"),
    "error between two tilt rates, with drops":
        shared_by_level("tilt", "tilt_rate_deg_s", "2", "drop"),
    "error between two heights": shared_by_level("drop", "drop_height_mm", "2"),
})  # fmt: skip
_add("declared", {
    "declared batches": shared_by_column("drop", "batch", 4, True),
    "declared batches, slides": shared_by_column("tilt", "batch", 4, True),
    "two instruments": shared_by_column("drop", "instrument", 2, True),
})  # fmt: skip
_add("null", {
    "plain drops": null("drop"),
    "plain slides": null("tilt"),
    "plain both": null("drop", "tilt"),
    "plain drops, 3 levels": null("drop", plan="3"),
    "plain both, 3 levels": null("drop", "tilt", plan="3"),
    "plain drops, single readings": null("drop", plan="3", written=singles),
    "plain shear": null("shear", plan="5"),
    "plain of all three": null("drop", "tilt", "shear"),
    "humidity without effect": null("drop", plan="3", column="humidity_percent"),
    "impacts without effect": null("drop", column="impact_number"),
    "heavy tails": null("drop", written=partial(means, tails=True)),
    "uneven noise": null("drop", uneven=True),
    "uneven noise, slides": null("tilt", plan="5", uneven=True),
    "batches that share nothing": named_batches("batch", 4),
    "instruments that agree": named_batches("instrument", 2),
})  # fmt: skip
_add("two-level null", {
    "two heights, four sizes": null("drop", plan="2"),
    "two rates, four sizes": null("tilt", plan="2"),
    "two of everything": null("drop", "tilt", plan="2x2"),
    "two levels of both": null("drop", "tilt", plan="2"),
    "two loads beside drops": null("shear", "drop", plan="2"),
})  # fmt: skip

FIRST_SEED = 1500
"""Seeds from here on were drawn for the campaign alone."""


def campaign() -> list[Case]:
    """Every case, fixed beforehand; each prefix is a fair sample of what the figures count.

    Laws at ten standard errors (two seeds), at five and twenty (one); rows at 15; faults at five
    and ten; nulls with twelve seeds, those of two levels with 32, so that a rate of 5 % shows.
    """
    asked = {
        "law": [(10.0, 0), (10.0, 1), (20.0, 2), (5.0, 3)],
        "two laws": [(10.0, 0), (10.0, 1), (20.0, 2), (5.0, 3)],
        "two-level law": [(10.0, 0), (20.0, 1)],
        "row": [(15.0, 0), (15.0, 1), (15.0, 2), (15.0, 3)],
        "level": [(10.0, 0), (10.0, 1), (20.0, 2), (10.0, 3)],
        "fault": [(10.0, 0), (5.0, 1), (10.0, 2)],
        "two-level error": [(10.0, 0), (5.0, 1), (10.0, 2), (5.0, 3)],
        "declared": [(10.0, 0), (5.0, 1), (10.0, 2)],
        "null": [(0.0, s) for s in range(12)],
        "two-level null": [(0.0, s) for s in range(32)],
    }
    rounds = 4
    each = {group: -(-len(of) // rounds) for group, of in asked.items()}
    all_of = [
        (k // each[kind.group], Case(name, size, FIRST_SEED + seed))
        for name, kind in KINDS.items()
        for k, (size, seed) in enumerate(asked[kind.group])
    ]
    # each round has a like share of every group, in an order that mixes the groups
    return [c for _, c in sorted(all_of, key=lambda c: (c[0], zlib.crc32(c[1].name.encode())))]


FIXED = tuple(
    Case(kind, size, 100)
    for size, kinds in {
        20.0: ("v^-0.6, 3 levels", "v^-0.25 and late hand", "humidity, drops", "air",
               "late hand, 4 levels", "seen after a slip", "rises with speed",
               "late hand, 2 rates"),
        15.0: ("one row, drops",),
        10.0: ("v^-0.6, 4 levels", "rebound 14 % lower at 4 mm", "132 mm for 120",
               "camera set up for each height", "error between two tilt rates",
               "wear in random order", "means written to 5 mm", "error from setting to setting",
               "declared batches"),
        0.0: ("plain both, 3 levels", "two rates, four sizes"),
    }.items()
    for kind in kinds
)  # fmt: skip
"""The default tests' cases, chosen with their seed before any verdict of theirs was seen."""

MIDDLE = tuple(
    Case(kind, 0.0 if "null" in KINDS[kind].group else 15.0, 200)
    for kind in KINDS
    if kind not in {c.kind for c in FIXED}
)
"""The slow tests' cases: every other kind once."""
