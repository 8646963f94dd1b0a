"""Which cause explains another code's runs: held-out scores against what chance makes of them.

A cause is scored by how well it predicts rows that are left out. Its strength and the scatter of
the rest are averaged over what the other rows allow. The best gain is compared with that on data
that differ from ours by chance alone. A cause may leave one row in ten as it is (a mixture of
following it and not). So a row that was read in another way does not hide what the others show.
Such rows are named by line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2, f, norm

from calibration.intake.quantities import QUANTITIES, measurable
from diagnosis.chance import CLOSE, share_above
from diagnosis.page.words import environment

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from diagnosis.other_code import Cause


REPLICATES = 299
FLOOR = 1e-6  # scatter below which two simulations are the same, as a share or in the unit
ASIDE = 0.1  # prior share of rows that do not follow a cause
ODD = 0.05  # probability of following the cause below which a row is named
PART = 0.05  # chance of what is left, below which a cause explains a part only
SCATTERS = np.geomspace(1e-3, 1.0, 29)
"""Of rows that follow a cause, over that of all about ours as it is; these are tried."""


def compare(
    runs: Sequence[Measurement],
    ours: np.ndarray,
    causes: Sequence[Cause],
    alpha: float = 0.05,
    seed: int = 0,
    spread: float | None = None,
) -> dict[str, Any]:
    """A mapping: experiment, runs, scatter before and after, verdict, ranking and a sentence.

    spread: standard deviation of the difference of two runs, theirs and ours, that differ by
    nothing but their seeds, in the quantity's unit; that of the table's own rows unless given.
    p_left, of a cause: chance of what it leaves, from its own spread, where it has one, or that,
    and from its own noise, where known. verdict: `agree` where the differences are no larger than
    that, `identified`, `ambiguous`, or `unexplained` where no cause that was tried predicts
    left-out runs better than chance. ours: (n,) values of our runs, in the quantity's unit.
    """
    words, unit, share = _quantity(runs[0])
    theirs, base = _both(runs, ours, share)
    tables = {c.name: (_scaled(c.values, share), _noise(c, share)) for c in causes}
    gains = {n: float(g[0]) for n, g in _gains(theirs[None], base, tables).items()}
    scatter = float(np.sqrt(np.mean((theirs - base) ** 2)))
    rng = np.random.default_rng([seed, 11])
    made = base + max(scatter, FLOOR) * rng.standard_normal((REPLICATES, len(base)))
    chance = np.max(list(_gains(made, base, tables).values()), axis=0)
    spread, freedom = _spread(runs, share) if spread is None else (spread, np.inf)
    order = sorted(causes, key=lambda c: -gains[c.name])
    ranking = [
        {"cause": c.name, "kind": c.kind, "gain": gains[c.name],
        "p": share_above(chance, gains[c.name]), "unit": c.unit}
        | _fit_of(c, runs, theirs, base, tables[c.name], spread, freedom)
        for c in order
    ]  # fmt: skip
    verdict, named = _verdict(ranking, theirs - base, spread, freedom, alpha)
    out = {
        "experiment": runs[0].experiment,
        "words": words,
        "runs": len(runs),
        "unit": "share" if share else unit,
    }
    out |= {"scatter_before": scatter, "spread": spread, "verdict": verdict, "causes": named}
    out["ranking"] = ranking
    return out | {"sentence": sentence_of(out)}


def in_part(runs: Sequence[Measurement], ours: np.ndarray, values: np.ndarray) -> dict[str, Any]:
    """A mapping of a cause whose values (k, n) are NaN where its runs have none: how many `runs`
    those are, and of the `others` the scatter before and after, at the strength that leaves
    least."""
    share = _quantity(runs[0])[2]
    theirs, base = _both(runs, ours, share)
    has = np.isfinite(values).all(0)
    after = [_rms(theirs[has] - _scaled(v[has], share)) for v in values]
    return {
        "runs": int(np.isnan(values).sum()),
        "others": int(has.sum()),
        "scatter_before": _rms(theirs[has] - base[has]),
        "scatter_after": min(after),
    }


def _fit_of(cause, runs, theirs, base, table, spread, freedom):
    """What a cause makes of all rows: its strength, what it leaves, and which rows do not follow
    it."""
    k, follows = _fitted(theirs, base, *table)
    off, kept = theirs - table[0][k], follows >= ODD
    spread = spread if cause.spread is None else cause.spread
    size = np.hypot(spread or 0.0, table[1][k])
    if spread:
        # a noise that is known makes the whole better known (Satterthwaite 1946, Biometrics 2:110)
        freedom = freedom * np.mean(size**2) ** 2 / spread**4
    return {
        "strength": float(cause.strengths[k]),
        "scatter_after": _rms(off),
        "scatter_of_most": _rms(off[kept]),
        "spread": spread,
        "p_left": _chance(off[kept], size[kept], freedom),
        "odd_lines": [m.line for m, own in zip(runs, kept, strict=True) if not own],
    }


def _quantity(run):
    """(words, unit, whether differences are shares) of what a run was compared on."""
    first = QUANTITIES[run.experiment]
    if run.quantity == first.name:
        return first.words, first.unit, first.relative
    return run.quantity.replace("_", " "), measurable(run.experiment)[run.quantity].unit, False


def _both(runs, ours, share):
    """Values (n,) of the runs and of ours, in the scale of the comparison."""
    return (_scaled(np.array(v, float), share) for v in ([m.value for m in runs], ours))


def _scaled(values, share):
    return np.log(np.maximum(values, 1e-9)) if share else values


def _spread(runs, share):
    """Root mean square standard error that the table states, in the scale of the comparison, and
    the degrees of freedom of its replicates; None without."""
    stated = [m for m in runs if m.sd]
    errors = [m.sd / np.sqrt(m.n) / (m.value if share else 1.0) for m in stated]
    freedom = sum(m.n - 1 for m in stated)
    return (_rms(np.array(errors)) if stated else None), freedom or np.inf


def _verdict(ranking, off, spread, freedom, alpha):
    """(verdict, names). Differences off (n,) that chance allows by the spread are no
    disagreement."""
    best = ranking[0]
    if spread is not None and _chance(off, np.full(len(off), spread), freedom) >= alpha:
        return "agree", []
    if best["p"] >= alpha:
        return "unexplained", []
    close = [r["cause"] for r in ranking if best["gain"] - r["gain"] < CLOSE]
    return ("identified" if len(close) == 1 else "ambiguous"), close


def _chance(off, size, freedom):
    """p of differences (n,) whose standard deviations (n,) are known with so many degrees of
    freedom (chi-square; Fisher's F where they are finite); None where one is not."""
    if not size.all():
        return None
    square, n = np.sum((off / size) ** 2), len(off)
    return float(chi2.sf(square, n) if np.isinf(freedom) else f.sf(square / n, n, freedom))


def _rms(off):
    return float(np.sqrt(np.mean(off**2))) if len(off) else 0.0


def _noise(cause, share):
    if cause.noise is None:
        return np.zeros(cause.values.shape)
    return cause.noise / np.maximum(cause.values, 1e-9) if share else cause.noise


def _gains(theirs, base, tables):
    """{cause: gain (b,) of the held-out score over ours as it is} for data sets (b, n); tables:
    {cause: (values (k, n), their noise (k, n))}."""
    off = theirs - base
    plain = _plain(off)
    scale = _scales(plain)[:, :, None]
    alone = _held_out(norm.logpdf(off[:, None], scale=scale))
    return {
        name: _held_out(_densities(theirs, values, noise, plain)) - alone
        for name, (values, noise) in tables.items()
    }


def _plain(off):
    """Log densities (b, n) of rows about ours as it is, the scatter that of the other rows."""
    square = off**2
    others = (square.sum(1, keepdims=True) - square) / (square.shape[1] - 1)
    return norm.logpdf(off, scale=np.sqrt(others + FLOOR**2))


def _held_out(density):
    """Sum (b,) of the log densities of rows that are left out: each is expected by all strengths
    and scatters, weighted by what they make of the other rows. density (b, c, n): log densities of
    rows at each of them."""
    whole = density.sum(2)
    without = logsumexp(whole[:, :, None] - density, axis=1)
    return (logsumexp(whole, axis=1)[:, None] - without).sum(1)


def _scales(plain):
    """Scatters (b, s) that are tried, of the size of the differences from ours as it is."""
    return np.exp(-plain.mean(1))[:, None] * SCATTERS + FLOOR


def _densities(theirs, values, noise, plain):
    """(b, k s, n) log densities of rows at each strength and scatter, following the cause or
    not."""
    off = theirs[:, None, None] - values[None, :, None]
    size = np.hypot(_scales(plain)[:, None, :, None], noise[None, :, None])
    follow = norm.logpdf(off, scale=size) + np.log1p(-ASIDE)
    both = np.logaddexp(follow, np.log(ASIDE) + plain[:, None, None])
    return both.reshape(len(theirs), -1, theirs.shape[1])


def _fitted(theirs, base, values, noise):
    """Place of the strength that all rows together choose, and the probability (n,) of each row to
    follow the cause there."""
    plain = _plain((theirs - base)[None])
    density = _densities(theirs[None], values, noise, plain)[0]
    best = int(density.sum(1).argmax())
    return best // len(SCATTERS), 1.0 - np.exp(np.log(ASIDE) + plain[0] - density[best])


def sentence_of(found: Mapping[str, Any]) -> str:
    """What was found, in words."""
    template = environment().get_template("compared.j2")
    return template.render(found=found, told=told, most_left=PART)


def told(value: float, unit: str) -> str:
    """A scatter in words."""
    return f"{100 * value:.2g} %" if unit == "share" else f"{value:.2g} {unit}"
