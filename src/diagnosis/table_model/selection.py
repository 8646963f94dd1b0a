"""Which terms the data ask for: forward selection with the chance of each step simulated, exchange
and elimination after each, and the rivals of what is left.

The statistic of a step is the largest evidence of any term of any experiment. Its chance is the
share of data sets, drawn from the model so far, in which any term has as much. Errors from setting
to setting stay in the model while laws are looked for, so that a second law is not taken for noise
that hides the first.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln

from diagnosis.chance import CLOSE, log_sum, share_above
from diagnosis.laws.readings import Readings
from diagnosis.table_model.block import LAW, ROW, Block, KnownCurves
from diagnosis.table_model.terms import LEAST_ROWS, all_terms

CHANCE = (999, 399, 399)
"""Data sets that are drawn for the first step, the second, and each after that."""

SPENT = (0.7, 0.2, 0.1)
"""Shares of the false-alarm rate that these steps may use."""

ODDS = float(np.log(20.0))
"""Log evidence by which a form must lead another one of its place for the other to be ruled out:
data made by the other lead so far in one case of twenty at most (Markov's inequality for a
likelihood ratio)."""

LEAST = 1.0  # log evidence below which a term that is held is dropped
BETTER = 0.2  # log evidence by which an exchange must be better
MOST_STEPS, SWEEPS = 8, 4
MOST_ROWS = 0.15  # share of an experiment's rows that may be set aside together
CLEAR = 6.0
"""Log evidence by which two laws or errors, or several rows, together must lead; a law and a row
are told from the law alone by ODDS."""

MOST_PAIRED = 3  # rows that are tried beside each other term
CHUNK = 250  # data sets at once


@dataclass(frozen=True)
class Step:
    """A term that was added: its evidence and chance."""

    key: str
    evidence: float
    p: float


@dataclass
class Selection:
    """blocks: {experiment: Block} with the terms held; steps: what was added, in turn; stopped: the
    best term that was not; p: chance of the first step; null: evidence that chance gave it, and
    the threshold that it had to pass."""

    blocks: dict
    steps: list
    stopped: Step | None
    p: float
    threshold: float
    null: np.ndarray


def blocks_of(parts: Iterable[Readings], known: KnownCurves | None) -> dict[str, Block]:
    """{experiment: Block} without a term; parts: [`Readings`]; known: a function of readings that
    gives the catalogue's curves, or None."""
    return {
        r.experiment: Block(r, {t.key: t for t in all_terms(r, known(r) if known else ())})
        for r in parts
    }


def select(blocks: dict[str, Block], alpha: float, seed: int, chance: Sequence[int]) -> Selection:
    """`Selection` of the terms of blocks {experiment: Block}."""
    steps, p, stopped, threshold, first = [], 1.0, None, 0.0, np.zeros(1)
    for number in range(MOST_STEPS):
        found = _best(blocks)
        if found is None:
            break
        kind, keys, value = found
        count = chance[min(number, len(chance) - 1)]
        null = of_chance(blocks, count, [seed, 1, number])
        here = share_above(null, value)
        level = alpha * SPENT[min(number, len(SPENT) - 1)]
        if not number:
            p, threshold, first = here, float(np.quantile(null, 1.0 - level)), null
        if here >= level:
            stopped = Step(keys[0], value, here)
            break
        steps += [Step(key, value, here) for key in keys]
        blocks = blocks | {kind: exchanged(held_in_turn(blocks[kind], keys))}
    return Selection(blocks, steps, stopped, p, threshold, first)


def misfit(
    blocks: Mapping[str, Block], seed: int = 0, count: int = CHANCE[0], scatter: bool = False
) -> dict[str, float]:
    """{chi_square, freedom, p} of blocks as they are, by the readings' own errors and those of
    declared batches and instruments, with `scatter` also those from setting to setting; few
    replicates do not know their spread, so p is simulated."""
    chi, null, freedom = 0.0, np.zeros(count), 0.0
    for place, block in enumerate(blocks.values()):
        places = np.arange(len(block.sds)) if scatter else block.bare()
        chi += float(block.chi_square(block.y[None], places)[0])
        among = np.isin(np.arange(len(block.sds)), places)
        share = block.shares() * among
        share = share if share.sum() > 0.0 else 1.0 * among
        rng = np.random.default_rng([seed, 21, place])
        made = block.draw(count, rng, share / share.sum())
        null += block.chi_square(made, places)
        freedom += block.freedom()
    return {"chi_square": chi, "freedom": max(freedom, 1.0), "p": share_above(null, chi)}


def _best(blocks):
    """(experiment, keys, evidence) of the best next term, or of two or several rows together."""
    found = []
    for kind, block in blocks.items():
        free = _of_free(block)
        if not free:
            continue
        key = max(free, key=free.get)
        best, together = ([key], free[key]), _rows_together(block)
        if together and together[1] > free[key] + CLEAR:
            best = together
        found.append((kind, *(_pair(block, key, best[1]) or best)))
    return max(found, key=lambda own: own[2], default=None)


def evidences(block: Block, y: np.ndarray) -> dict[str, np.ndarray]:
    """{key: log evidence (b,)} of every term for data sets y (b, n); of a term that is held, beyond
    what is held."""
    base = block.base(y)
    return {key: block.evidence(t, y, base) for key, t in block.terms.items()}


def _of_free(block):
    """{key: log evidence} of the terms that are not held, for the readings."""
    values = evidences(block, block.y[None])
    return {key: float(value[0]) for key, value in values.items() if key not in block.held}


def of_chance(blocks: Mapping[str, Block], count: int, seed: Sequence[int]) -> np.ndarray:
    """(count,) largest evidence of any term that is not held, of data drawn from the blocks."""
    out = []
    for place, block in enumerate(blocks.values()):
        # random numbers of its own: by the same ones chance would favour both experiments at once
        rng = np.random.default_rng([*seed, place])
        made = block.draw(count, rng)
        free = replace(block, terms={k: t for k, t in block.terms.items() if k not in block.held})
        best = [
            np.max(list(evidences(free, made[i : i + CHUNK]).values()), axis=0)
            for i in range(0, count, CHUNK)
        ]
        out.append(np.concatenate(best))
    return np.max(out, axis=0)


def exchanged(block: Block) -> Block:
    """The block with each held term at its best beside the others, exchanged for a better one or
    dropped where little is left for it; two terms may also be exchanged at once."""
    block = _swept(block)
    terms = [k for k, t in block.terms.items() if t.kind != ROW]
    held = [k for k in block.held if k in terms]
    for key in held if len(held) > 1 else ():
        if key not in block.held:
            continue
        rest = block.without(key)
        for other in (k for k in terms if k not in block.held):
            tried = _swept(rest.holding(other))
            if len(tried.held) <= len(block.held) and tried.score() > block.score() + BETTER:
                block = tried
                break
    return block


def _swept(block):
    """The block with each held term in turn at its best beside the others."""
    for _ in range(SWEEPS):
        before = tuple(block.held)
        for key in before:
            rest = block.without(key)
            values = _of_free(rest)
            best = max(values, key=values.get)
            if values[best] < LEAST:
                block = rest
                continue
            block = rest.holding(best if values[best] > values[key] + BETTER else key)
        if set(block.held) == set(before):
            break
    return block


def strength_of(block: Block, key: str) -> float:
    """Log evidence of a held term beside the other ones."""
    rest = block.without(key)
    return float(rest.evidence(block.terms[key], block.y[None])[0])


@dataclass(frozen=True)
class Rival:
    """A term in the place of a held one: its key, by how much log evidence it is behind, and the
    key of one level that was set wrongly, with that level, where the two together take the
    place."""

    key: str
    behind: float
    beside: str = ""
    level: str = ""


def rivals(block: Block, key: str) -> list[Rival]:
    """The terms that are not told apart from a held one: put in its place they have less than CLOSE
    less evidence, or they are one thing with it by the plan. The nearest first.

    Of 8,300 data sets that were drawn from every law and every error of the set-up, on plans of two
    to five levels, another term led a law by CLOSE in 2 %, and a law an error in 2 %."""
    own, values = _in_place_of(block, key)
    near = {k: Rival(k, own - v) for k, v in values.items()
            if v > 0.0 and (own - v < CLOSE or _one_by_plan(block, key, k))}  # fmt: skip
    for rival in _beside_one_level(block, key, own):
        if rival.key not in near and rival.behind < CLOSE:
            near[rival.key] = rival
    return sorted(near.values(), key=lambda rival: rival.behind)


def set_anew(block: Block, key: str) -> Rival | None:
    """Return what a level that is set anew would tell from a held term, though the evidence may
    tell the two apart: beside an error of each level the best law of that lever, beside a law of
    one lever that error."""
    own, values = _in_place_of(block, key)
    near = [Rival(k, own - v) for k, v in values.items()
            if _of_one_lever(block.terms[key], block.terms[k])]  # fmt: skip
    return min(near, key=lambda r: r.behind, default=None)


def _in_place_of(block, key):
    """Log evidence of a held term beside the others, and {key: that} of each term in its place."""
    values = _of_free(block.without(key))
    return values.pop(key), values


def _of_one_lever(one, other):
    """Return whether two terms are a law of one lever alone and an error of each of its levels."""
    law, error = sorted((one, other), key=lambda t: t.kind != LAW)
    return bool(law.law) and error.what == "levels" and law.law.needs == (error.of,)


LEAST_BESIDE = 5
"""Levels for a law and one level that was set wrongly: of four what is left are three, which every
curve meets."""


def _beside_one_level(block, key, own):
    """`Rival`s of an error of each level: a law of the lever with one level set wrongly."""
    held = block.terms[key]
    asked = held.experiment, "one level", held.of
    wrong = next((t for t in block.terms.values() if (t.experiment, t.what, t.of) == asked), None)
    if held.what != "levels" or wrong is None or wrong.key in block.held:
        return
    if _levels(block, held) < LEAST_BESIDE:
        return
    rest = block.without(key)
    start = rest.score()
    free = [t for k, t in rest.terms.items() if k not in rest.held]
    for law in (t for t in free if _of_one_lever(t, held)):
        both = held_in_turn(rest, (law.key, wrong.key, law.key, wrong.key))
        level = both.held[wrong.key].shape.name
        yield Rival(law.key, float(own - (both.score() - start)), wrong.key, level)


def held_in_turn(block: Block, keys: Iterable[str]) -> Block:
    """The block with those of the terms held that it has, each in turn at its likeliest beside
    those that are."""
    for key in (k for k in keys if k in block.terms):
        block = block.without(key).holding(key)
    return block


def _one_by_plan(block, key, other):
    """Return whether a law of one lever with two levels and an error of these levels are
    compared."""
    terms = block.terms[key], block.terms[other]
    return _of_one_lever(*terms) and 2 in (_levels(block, term) for term in terms)


def _levels(block, error):
    """Number of levels of the lever that an error of the set-up is of."""
    return len(block.readings.of(error.experiment)[0].folds.get(error.of, ()))


# --- several terms at once ---------------------------------------------------------------------


def _pair(block, single, least):
    """(keys, evidence) of the two laws or errors, or of one and a row, that together explain most,
    or None where they do not clearly explain more than the best single term and than evidence
    `least`.

    A law of two states at once is nearer to both than either law alone. A row that is far off bends
    a law that is fitted with it, and without the law all rows look off: alone neither leads."""
    start = block.score()
    rows = [k for k, t in block.terms.items() if t.kind == ROW and k not in block.held]
    free = [k for k in block.terms if k not in block.held and k not in rows]
    if not free or len(free) + len(rows) < 2 or len(block.y) < LEAST_ROWS:
        return None

    alone, best = max(block.holding(single).score(), start + least), None
    for first in free:
        now = block.holding(first)
        others = {k: now.terms[k] for k in (*free, *rows) if k != first}
        values = _of_free(replace(now, terms=others))
        for second in (*_most(values, free, 1), *_most(values, rows, MOST_PAIRED)):
            both = now.holding(second).without(first).holding(first)
            lead = both.score() - alone - (ODDS if second in rows else CLEAR)
            if best is None or lead > best[1]:
                best = [first, second], lead, both.score() - start
    return (best[0], float(best[2])) if best and best[1] > 0.0 else None


def _most(values, keys, count):
    """The keys of the largest values, at most so many."""
    return sorted((k for k in keys if k in values), key=lambda k: -values[k])[:count]


def _rows_together(block):
    """(keys, evidence) of the two rows or more that together explain most, or None.

    They are looked for one by one beside the readings' own errors alone: beside an error from
    setting to setting each hides the others."""
    y, n = block.y, len(block.y)
    keys = [k for k, t in block.terms.items() if t.kind == ROW and k not in block.held]
    if n < LEAST_ROWS or len(keys) < 2:
        return None
    most = max(int(MOST_ROWS * n), 1)
    bare = next(g for g, c in enumerate(block.sds) if not c)
    now, chosen, best = block, [], None
    start = log_sum(block.here)
    for _ in range(most):
        z = y - now.mean
        p = now.precision[bare]
        gain = (p @ z) ** 2 / np.diag(p)
        key = max((k for k in keys if k not in chosen), key=lambda k: gain[block.terms[k].rows[0]])
        chosen.append(key)
        now = now.holding(key)
        count = len(chosen)
        choose = gammaln(n + 1) - gammaln(count + 1) - gammaln(n - count + 1)
        occam = count * np.log(len(block.terms[key].shapes[0].label))
        value = log_sum(now.here) - start - choose - occam
        if count > 1 and (best is None or value > best[1]):
            best = list(chosen), float(value)
    return best
