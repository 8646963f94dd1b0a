"""Which mechanism explains a misfit: the whole catalogue against what data of the base model give.

A mechanism's gain is that in log evidence over the base model. The null distribution is that of the
best gain of all mechanisms on data simulated from the fitted base model with the errors as stated
(parametric bootstrap). This keeps the chance of a false alarm over the whole catalogue. It is
shared with the lack-of-fit test as Simes' test shares it.

The score that ranks mechanisms is the mean of the log evidence and of the sum over settings of the
log predictive density of each when it is left out. A model's spread is scaled up there where it
does not fit.

A mechanism is then told from errors of the set-up by its odds (`diagnosis.set_up_errors`): from one
setting that is off, and from an error of each setting, which is what twice the noise looks like."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import expit
from scipy.stats import chi2

from calibration.statistics.numbers import NORMAL_95
from diagnosis.chance import CLOSE, share_above
from diagnosis.fit import Data, evidence, fit
from diagnosis.measurements import LEAST_SETTINGS
from diagnosis.reading_errors import redrawn_error
from diagnosis.set_up_errors import EVERY, ONE, log_evidence, set_up_errors
from diagnosis.settings import BASE

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from calibration.intake.quantities import Condition
    from diagnosis.catalogue import Mechanism
    from diagnosis.fit import Fit
    from diagnosis.model import Emulated, Model


CARRIED = 0.25  # variance left of the prior's, along a direction of the parameters, at most
MISFIT = 0.01  # a cause whose extended model fits worse than this share of its own data is none
PLACED = ("identified", "discovered")  # verdicts that know the place of a law
NULL_STARTS = (0.3,)  # coded strength at which fits of data without an effect begin: one is enough


@dataclass
class Identification:
    """What the scores say; `fits` holds the fit of each candidate, by its names joined with ' + ';
    tried: how many of them were compared with the base model; errors: gains in log evidence of
    errors of the set-up; error: that which leads the mechanisms or is not told from them."""

    verdict: str
    causes: list
    ranking: list
    lack_of_fit_p: float
    family_p: float
    level: float
    threshold: float
    fits: dict = field(repr=False)
    models: dict = field(repr=False)
    data: Data = field(default=None, repr=False)  # type: ignore[assignment]
    reason: str = ""
    tried: int = 0
    errors: dict = field(default_factory=dict)
    error: str = ""


def key_of(names: Iterable[str]) -> str:
    """Name of a set of mechanisms."""
    return " + ".join(names) if names else BASE


@dataclass
class Scores:
    """Fits of the base model and of every mechanism to the measurements, and what data of the base
    model would give.

    measurements: those with a value. null: gains (replicates,) of each mechanism, and `misfit` of
    the base model, on simulated data.
    """

    emulated: object
    measurements: list
    data: Data
    models: dict
    fits: dict
    null: dict
    replicates: int
    seed: int

    @cached_property
    def evidence(self) -> dict[str, float]:
        """{model: its log evidence}."""
        return {
            name: float(log_evidence(model, self.data, self.fits[name])[0])
            for name, model in self.models.items()
        }

    @property
    def conditions(self) -> list[Condition]:
        """The `Condition` of each measurement."""
        return [m.condition for m in self.measurements]

    @property
    def lack_p(self) -> float:
        """Share of data of the base model that it misses as badly as the measurements."""
        return share_above(self.null["misfit"], float(self.fits[BASE].misfit[0]))


def identify(
    emulated: Emulated,
    measurements: Sequence[Measurement],
    alpha: float = 0.05,
    replicates: int = 300,
    seed: int = 0,
) -> Identification:
    """`Identification` of the measurements, tests without a value among them."""
    return decide(weigh(emulated, measurements, replicates, seed), alpha)


def weigh(
    emulated: Emulated,
    measurements: Sequence[Measurement],
    replicates: int = 300,
    seed: int = 0,
    names: Iterable[str] | None = None,
) -> Scores:
    """`Scores` of the base model and of the mechanisms in `names`, the whole catalogue unless
    given."""
    measurements, tried, data = evidence(emulated, measurements)
    conditions = [m.condition for m in measurements]
    models = {BASE: emulated.model(conditions, (), tried)}
    names = emulated.applicable(conditions) if names is None else names
    models |= {name: emulated.model(conditions, [name], tried) for name in names}
    fits = {name: fit(model, data) for name, model in models.items()}
    rng = np.random.default_rng(seed)
    null = null_of(models, fits[BASE], measurements, data, replicates, rng)
    return Scores(emulated, measurements, data, models, fits, null, replicates, seed)


def decide(scores: Scores, alpha: float = 0.05, without: Collection[str] = ()) -> Identification:
    """`Identification` from the scores; mechanisms in `without` count as not in the catalogue."""
    fits, null = scores.fits, scores.null
    singles = [n for n in scores.models if n != BASE and n not in without]
    gains = {name: scores.evidence[name] - scores.evidence[BASE] for name in singles}
    score = {name: 0.5 * (scores.evidence[name] + float(fits[name].score[0])) for name in fits}
    best = max(gains, key=gains.get)  # type: ignore[arg-type]
    null_best = np.max([null[n] for n in singles], axis=0)
    lack_p = scores.lack_p
    family_p = share_above(null_best, gains[best])
    misfit, gained = significant(lack_p, family_p, alpha)
    level = level_beside(lack_p, alpha)
    threshold = float(np.quantile(null_best, 1.0 - level))
    ranking = [
        {
            "mechanism": name,
            "score": score[name],
            "gain": gains[name],
            "null_threshold": float(np.quantile(null[name], 1.0 - level)),
            "p": share_above(null[name], gains[name]),
            "p_family": share_above(null_best, gains[name]),
            "strength": strength_of(scores.models[name], fits[name], 0),
        }
        for name in sorted(singles, key=score.get, reverse=True)  # type: ignore[arg-type]
    ]
    out = Identification(
        "", [], ranking, lack_p, family_p, level, threshold, dict(fits), dict(scores.models),
        scores.data, tried=len(singles),
    )  # fmt: skip
    if not (misfit or gained):
        out.verdict, out.reason = "adequate", "the base model fits within the stated spread"
        return out
    out.errors = set_up_errors(scores.models[BASE], scores.data, fits[BASE])
    error = max(out.errors, key=out.errors.get)  # type: ignore[arg-type]
    lead = out.errors[error] - (ranking[0]["gain"] if gained else 0.0)
    if lead > CLOSE or not gained:
        out.verdict, out.error = "unexplained", error if lead > CLOSE else ""
        out.reason = LEADS[error] if out.error else NOTHING
        return out
    _settle(out, scores, singles)
    if lead > -CLOSE and out.causes:
        out.verdict, out.error, out.reason = "ambiguous", error, TIES[error]
    return out


LEADS = {
    ONE: "one setting alone is at odds with the base model",
    EVERY: "an error of each setting explains the misfit better than any mechanism",
}
TIES = {
    ONE: "one setting that is at odds with the others explains as much as a law",
    EVERY: "an error of each setting explains as much as a law: one that is set anew would tell",
}
NOTHING = "the base model misses the data, and no mechanism gains more than chance gives"
"""What is said where an error of the set-up leads the mechanisms, where it is not told from one,
and where neither explains a misfit."""


def lack_of_fit(fitted: Fit, p: float) -> dict[str, float]:
    """The mapping of verdict.json of the base model's fit, with the chance p of such a misfit: the
    chi-square of the readings, and beside it the deviance of tests without a value."""
    out = {"chi_square": float(fitted.chi_square[0]), "freedom": float(fitted.freedom[0])}
    if fitted.deviances.size:
        out["deviance"] = float(fitted.deviances.sum())
    return out | {"p": p}


def carried(model: Model, fitted: Fit) -> int:
    """Number of coefficients that the data carry: directions of the parameters along which their
    Fisher information leaves at most a quarter of the prior's variance, half its standard
    deviation."""
    left = fitted.cov[0] / np.outer(model.prior_sd, model.prior_sd)
    return int((np.linalg.eigvalsh(left) <= CARRIED).sum())


def significant(first: float, second: float, alpha: float) -> tuple[bool, bool]:
    """Which of two p-values of one null hypothesis are significant: both below alpha, or one below
    half of it.

    The chance of any false alarm is at most alpha for positively dependent tests, as misfit and
    gain are: Simes (1986), Biometrika 73:751; Hochberg (1988), Biometrika 75:800.
    """
    return first < level_beside(second, alpha), second < level_beside(first, alpha)


def level_beside(other: float, alpha: float) -> float:
    """What a p-value must be below to be significant beside another one: alpha where that is below
    it, else half."""
    return alpha if other < alpha else 0.5 * alpha


def simulate_data(
    model: Model,
    fitted: Fit,
    measurements: Sequence[Measurement],
    data: Data,
    replicates: int,
    rng: np.random.Generator,
) -> Data:
    """`Data` of `replicates` sets from a fit: noise as measured and the emulators' error.

    An emulator errs alike at settings that are alike, which looks like a trend; its errors are
    drawn so.
    The spreads that a laboratory would have found are drawn anew and treated as those of the
    measurements. So are errors that readings share, of a size that the readings leave probable, and
    how many of the tests fail; which conditions have readings is not.
    """
    truth = fitted.predicted[0]
    emulator = np.sqrt(np.maximum(fitted.sd[0] ** 2 - data.error[0] ** 2, 0.0))
    root = _root(model.error_correlation(fitted.theta[0]))
    noise = data.error[0] * rng.standard_normal((replicates, len(truth)))
    noise += emulator * (rng.standard_normal((replicates, len(truth))) @ root.T)
    if data.shared is not None:
        noise += _shared_errors(data.shared, fitted.sizes[0], replicates, rng)
    value = truth + noise
    drawn = redrawn_error(measurements, data.error[0], replicates, rng)
    if data.failed is None:
        return replace(data, value=value, error=drawn)
    odds, _ = model.odds(fitted.theta[:1], slope=False)
    failed = rng.binomial(data.tests.astype(int), expit(odds[0]), (replicates, len(data.tests)))  # type: ignore[arg-type, union-attr]
    return replace(data, value=value, error=drawn, failed=failed.astype(float))


def _shared_errors(shared, sizes, replicates, rng):
    """Errors (replicates, n) of batches and instruments, of sizes that are drawn by their
    probabilities (g,)."""
    places = rng.choice(len(sizes), replicates, p=sizes)
    errors = rng.standard_normal((replicates, shared.covariance.shape[1]))
    for place in np.unique(places):
        rows = places == place
        errors[rows] = errors[rows] @ _root(shared.covariance[place]).T
    return errors


def _root(covariance):
    """R (n, n) with R R' the covariance, which may be singular."""
    size, direction = np.linalg.eigh(covariance)
    return direction * np.sqrt(np.maximum(size, 0.0))


def _fits_well(out, name, scores, rng):
    """Whether the misfit of the fit is within the 99 % of data made by that model."""
    model, fitted = out.models[name], out.fits[name]
    simulated = simulate_data(
        model, fitted, scores.measurements, scores.data, scores.replicates, rng
    )
    null = fit(model, simulated).misfit
    return share_above(null, float(fitted.misfit[0])) >= MISFIT


def null_of(
    models: Mapping[str, Model],
    fitted: Fit,
    measurements: Sequence[Measurement],
    data: Data,
    replicates: int,
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    """Null gains (replicates,) of each mechanism over the base model, and the misfit of the base
    model."""
    simulated = simulate_data(models[BASE], fitted, measurements, data, replicates, rng)
    reference = fit(models[BASE], simulated)
    of_base = log_evidence(models[BASE], simulated, reference)
    gains = {
        n: log_evidence(m, simulated, fit(m, simulated, NULL_STARTS)) - of_base
        for n, m in models.items()
        if n != BASE
    }
    return gains | {"misfit": reference.misfit}


def _settle(out, scores, singles):
    """Choose among the causes: one, several that are too close, a pair, or none that fits."""
    rng = np.random.default_rng([scores.seed, 1])
    best = out.ranking[0]["mechanism"]
    if not _fits_well(out, best, scores, rng):
        pair = _best_pair(out, scores, singles, rng)
        if pair:
            out.verdict, out.causes = pair
            out.reason = "no single mechanism fits; these two together do"
            _doubt(out, scores, key_of(pair[1]))
            return
        out.verdict = "unexplained"
        out.reason = f"{best} helps most, but the data still contradict it"
        return
    out.causes = [r["mechanism"] for r in out.ranking if not _told_apart(out, r, scores)]
    out.verdict = "identified"
    out.reason = "these data favour it over every other mechanism"
    if len(out.causes) > 1:
        placed = one_place(scores.emulated.catalogue[n] for n in out.causes)
        out.verdict = "discovered" if placed else "ambiguous"
        out.reason = "these data favour none of these over another"
        out.reason += ": the place is known, and no single name" if placed else ""
    _doubt(out, scores, best)


ODDS = float(np.log(20.0))
"""Log odds by the data from which a law of another slot is told apart, though its score is close:
few settings say little by what is left out."""

ONE_FORMULA = {"attraction", "load"}
"""Slots whose laws add the same to a whole yield locus."""


def _told_apart(out, row, scores):
    """Whether the best of the ranking is told apart from the mechanism of a row.

    Of two laws in one slot the same is expected. One that fits, and would be as good with the
    emulator of the best, is behind for its own emulator alone. So is an attraction beside a load
    that was not counted."""
    best = out.ranking[0]
    behind = best["score"] - row["score"]
    names = best["mechanism"], row["mechanism"]
    first, own = (out.fits[n] for n in names)
    alike = _alike(scores, *names)
    if behind < CLOSE:
        one, two = (scores.evidence[n] for n in names)
        return not alike and one - two > ODDS
    if not alike:
        return True
    if chi2.sf(float(own.misfit[0]), float(own.freedom[0])) < MISFIT:
        return True
    rougher = float(np.log(np.maximum(own.sd / first.sd, 1.0)).sum())
    return behind - rougher >= CLOSE


def _alike(scores, *names):
    """Whether mechanisms are laws of one slot, or of two that are one formula."""
    slots = {slot for slot, _ in _laws(scores, *names)}
    return len(slots) == 1 or slots == ONE_FORMULA


def _laws(scores, *names):
    """Laws of mechanisms; that of one without a place is its own name."""
    catalogue = scores.emulated.catalogue
    return [catalogue[n].law or (n, ()) for n in names]


def one_place(mechanisms: Sequence[Mechanism]) -> bool:
    """Whether mechanisms are cases of one law: of one slot, and its states those of one of them."""
    laws = [m.law for m in mechanisms]
    if None in laws or len({slot for slot, _ in laws}) > 1:  # type: ignore[misc]
        return False
    most = max((set(state) for _, state in laws), key=len)  # type: ignore[misc]
    return all(set(state) <= most for _, state in laws)  # type: ignore[misc]


def _doubt(out, scores, name):
    """Turn a verdict of `PLACED` into `ambiguous` where the data cannot bear it."""
    _doubt_a_rough_emulator(out, name)
    _doubt_few_settings(out, scores)
    _doubt_few_coefficients(out, name)


def _doubt_few_coefficients(out, name):
    """Turn a verdict of `PLACED` into `ambiguous` where the data carry no coefficient more with
    each cause that is added: what the causes are given is then taken from the base parameters."""
    if out.verdict not in PLACED or name not in out.fits:
        return
    model, fitted = out.models[name], out.fits[name]
    before = carried(out.models[BASE], out.fits[BASE])
    more = carried(model, fitted) - before
    if more < len(model.mechanisms):
        out.verdict = "ambiguous"
        out.reason = (
            f"the data carry {before} coefficients of the base model and {max(more, 0)} more with "
            f"{name}, which asks for {len(model.mechanisms)}: base parameters may do the same"
        )


def _doubt_few_settings(out, scores):
    """Turn a verdict of `PLACED` into `ambiguous` where the experiments that show the cause have
    few settings."""
    for name in out.causes if out.verdict in PLACED else ():
        shown = scores.emulated.catalogue[name].experiments
        settings = sum(m.experiment in shown for m in scores.measurements)
        settings += sum(e in shown for e, _ in _without_readings(scores))
        if settings < LEAST_SETTINGS:
            out.verdict = "ambiguous"
            out.reason = (
                f"{name} would rest on {settings} settings; of fewer than {LEAST_SETTINGS} an "
                "error from one setting to the next is not told from a cause"
            )


def _without_readings(scores):
    """Conditions of which every test ended without a value."""
    data, tests = scores.data, scores.models[BASE].tests
    if not tests:
        return []
    return [c for c, f, n in zip(tests, data.failed[0], data.tests, strict=True) if f == n]


def _doubt_a_rough_emulator(out, name):
    """Turn a verdict of `PLACED` into `ambiguous` where the cause fits only within the error of its
    own emulator.

    Such a model is not tested by the data: a cause that the catalogue lacks would pass for it. The
    test takes the spread that the base model's predictions have in place of that of the cause's.
    """
    if out.verdict not in PLACED or name not in out.fits:
        return
    fitted, sharp = out.fits[name], out.fits[BASE].sd
    chi = float(((fitted.residual * fitted.sd / sharp) ** 2).sum())
    if chi2.sf(chi, float(fitted.freedom[0])) < MISFIT:
        out.verdict = "ambiguous"
        out.reason = (
            "it fits only within the error of its own emulator: something else may do better"
        )


def _best_pair(out, scores, singles, rng):
    """(verdict, causes) where two mechanisms together fit and gain significantly over the best one;
    else None.

    What is significant is known from data of the best one's own fit: the threshold of a single
    mechanism is that of fewer models with one strength less."""
    by_pair = {}
    for pair in combinations(singles, 2):
        if not scores.emulated.combine(scores.conditions, pair):
            continue
        name = key_of(pair)
        tests = out.models[BASE].tests
        out.models[name] = scores.emulated.model(scores.conditions, pair, tests)
        out.fits[name] = fit(out.models[name], scores.data)
        by_pair[pair] = float(log_evidence(out.models[name], scores.data, out.fits[name])[0])
    out.tried += len(by_pair)
    ordered = sorted(by_pair, key=by_pair.get, reverse=True)
    if not ordered:
        return None
    first, single = ordered[0], out.ranking[0]
    alone = scores.evidence[single["mechanism"]]
    lead = by_pair[first] - alone
    null = _null_of_pairs(out, scores, single["mechanism"], ordered, rng)
    threshold = float(np.quantile(null, 1.0 - out.level))
    if lead < threshold or not _fits_well(out, key_of(first), scores, rng):
        return None
    close = [p for p in ordered if by_pair[first] - by_pair[p] < CLOSE]
    out.ranking = [
        {
            "mechanism": key_of(p),
            "score": by_pair[p],
            "gain": by_pair[p] - scores.evidence[BASE],
            "null_threshold": single["gain"] + threshold,
            "p": share_above(null, by_pair[p] - alone),
        }
        for p in ordered[:3]
    ] + out.ranking
    if len(close) == 1:
        return "identified", list(first)
    return "ambiguous", sorted({m for p in close for m in p})


def _null_of_pairs(out, scores, single, ordered, rng):
    """By how much (replicates,) the best pair beats one mechanism on data of that mechanism's fit.

    Pairs that it is not one of would have to imitate it: of them the best on the measurements alone
    is tried."""
    simulated = simulate_data(
        out.models[single],
        out.fits[single],
        scores.measurements,
        scores.data,
        scores.replicates,
        rng,
    )
    tried = [single, *(key_of(p) for p in ordered if single in p or p == ordered[0])]
    alone, *together = (
        log_evidence(out.models[n], simulated, fit(out.models[n], simulated, NULL_STARTS))
        for n in tried
    )
    return np.max(together, axis=0) - alone


def strength_of(model: Model, fitted: Fit, row: int) -> dict[str, dict[str, Any]]:
    """{name, unit, value, low, high} of each mechanism's strength: mode and 95 % interval, cut at
    its range."""
    out = {}
    for k, m in enumerate(model.mechanisms, len(model.factors)):
        u, sd = fitted.theta[row, k], np.sqrt(fitted.cov[row, k, k])
        low, high = np.clip([u - NORMAL_95 * sd, u + NORMAL_95 * sd], 0.0, 1.0)
        out[m.name] = {
            "name": m.strength.name,
            "unit": m.strength.unit,
            "value": float(m.strength.natural(u)),
            "low": float(m.strength.natural(low)),
            "high": float(m.strength.natural(high)),
        }
    return out
