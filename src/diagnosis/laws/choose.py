"""Which law the readings show: held-out scores of the family, and what chance makes of them.

The statistic is the gain of the best law of the whole family over none in predicting whole levels
that were left out. Its chance comes from data simulated from the fit without a law, errors between
settings, batches and levels included. A rival is ruled out where data made by it let the best law
lead by as much in less than 5 % of cases.
"""

from dataclasses import dataclass, field

import numpy as np

from diagnosis.chance import share_above
from diagnosis.laws.mixed import draw, evaluate, nuisance_of, to_space
from diagnosis.laws.slots import applicable, candidate_of, constant

OF_CHANCE = 999  # data without a law: a p of 0.05 is then known to 0.007
FAR = 12.0  # nats behind the best at which a rival is out without a simulation


@dataclass
class Trial:
    """Every law's fit to one experiment's readings, and the gains (r,) that chance makes."""

    readings: object
    nuisance: object
    centre: np.ndarray
    laws: dict
    candidates: dict
    fits: dict
    base: object
    base_fit: object
    null_gain: dict = field(default_factory=dict)

    @property
    def gains(self):
        """{name: gain in nats}."""
        score = self.base_fit.score[0]
        return {k: float(f.score[0] - score) for k, f in self.fits.items()}


def centre_of(readings, nuisance):
    """(n,) logarithm of the best constant, alike at all settings."""
    weight = 1.0 / readings.error**2
    return np.full(len(readings.log), (weight * readings.log).sum() / weight.sum())


def trial(readings, known=(), replicates=OF_CHANCE, seed=(0, 1), everything=False):
    """`Trial` of every free law and of the catalogue's curves (`known`, functions of readings and
    centre).

    seed: of numpy's generator, for the data that chance makes.
    everything: also of laws whose term would have the wrong sign here, for readings that are but a
    guess."""
    nuisance = nuisance_of(readings)
    centre = centre_of(readings, nuisance)
    laws = {law.name: law for law in applicable(readings)}
    candidates = {name: candidate_of(law, readings, centre) for name, law in laws.items()}
    for make in known:
        candidates |= make(readings, centre)
    base, log = constant(readings), readings.log[None]
    base_fit = evaluate(base, readings, nuisance, log, centre)
    fits = {k: evaluate(c, readings, nuisance, log, centre) for k, c in candidates.items()}
    for name, law in () if everything else laws.items():
        if law.sign * _term(law, candidates[name], fits[name], nuisance, readings, centre) < 0.0:
            del candidates[name], fits[name]
    laws = {name: law for name, law in laws.items() if name in candidates}
    out = Trial(readings, nuisance, centre, laws, candidates, fits, base, base_fit)
    if replicates:
        rng = np.random.default_rng(seed)
        data = draw(base, nuisance, base_fit, log, centre, readings, replicates, rng)
        nothing = evaluate(base, readings, nuisance, data, centre).score
        out.null_gain = {
            k: evaluate(c, readings, nuisance, data, centre).score - nothing
            for k, c in candidates.items()
        }
    return out


def _term(law, candidate, fit, nuisance, readings, centre):
    """Mean over the settings of a fitted law's term: its sign tells whether it pulls or pushes."""
    z, slope = to_space(candidate.space, readings.log, centre)
    own = candidate.covariance[fit.smooth[0]]
    shared = nuisance.covariance[fit.nuisance[0]] * np.outer(slope, slope)
    total = own + shared + candidate.level**2
    return float((own @ np.linalg.solve(total, z)).mean())


def chance(tried):
    """p of the best gain over the whole family, by simulation."""
    if not tried.candidates:
        return 1.0
    best = np.max(list(tried.null_gain.values()), axis=0)
    return share_above(best, max(tried.gains.values()))


def ruled_out(tried, best, rival, replicates=99, seed=0):
    """Share of data simulated from the rival's own fit on which the best leads by as much as
    here."""
    gains = tried.gains
    lead = gains[best] - gains[rival]
    if lead > FAR:
        return 1.0 / (1 + replicates)
    c, f = tried.candidates[rival], tried.fits[rival]
    rng = np.random.default_rng([seed, 2])
    data = draw(
        c,
        tried.nuisance,
        f,
        tried.readings.log[None],
        tried.centre,
        tried.readings,
        replicates,
        rng,
    )
    score = {
        k: evaluate(tried.candidates[k], tried.readings, tried.nuisance, data, tried.centre).score
        for k in (best, rival)
    }
    return share_above(score[best] - score[rival], lead)
