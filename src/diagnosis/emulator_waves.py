"""Waves: further runs of the engine where they decide, until an emulator's error there is below
0.3 of the measurement's.

A first emulator is spread over whole ranges. A wave runs the base model and each mechanism that is
still in play, each about its own best point: at parameters drawn from the posterior that the
emulators of the wave before give, at the measured settings, the seeds common to all. Of a budget
the base model has half of a wave, for its error would else excuse it; the mechanisms have the rest
alike, as many of the best as it is enough for. The emulators are trained anew by all runs (Vernon,
Goldstein, Bower 2010, Bayesian Anal. 5:619). The number of waves and of runs in each is capped by
the settings, and the verdict says what is left.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import norm, qmc

from dem.errors import SpecError
from diagnosis.bulk import Bulk
from diagnosis.design import LEARN, OF_BASE, factor_share, inputs_of, row_of
from diagnosis.fit import Fit
from diagnosis.model import Model
from diagnosis.rig import Rig
from diagnosis.settings import BASE, lever_values
from diagnosis.table_model.found import catalogue_gains

SHARE = 0.3
"""Error of an emulator over that of the measurement at which it is good enough."""

IN_PLAY = 5.0
"""Nats behind the best model (odds of 150 to 1) up to which a mechanism is still in play."""

MOST = 4  # mechanisms with runs of their own that are refined, best first
LEAST_OF_A_WAVE = 6  # runs of a mechanism: fewer settle nothing, and the best are refined alone
REACH = 1.5  # standard deviations of the posterior over which one of the draws spreads
SEEDS = 10_000  # between the seeds of two waves


def modes(bulk: Bulk) -> dict[str, tuple[Model, Fit]]:
    """{name: (`Model`, `Fit`)} of the base model and of the mechanisms still in play, best first.

    One whose emulator is too rough to be judged stays in play."""
    fits = {name: bulk.fit((name,)) for name in bulk.emulated.applicable(bulk.conditions)}
    [block] = bulk.block().values()
    gain = dict.fromkeys(fits, 0.0) | {s.name: v for _, s, v in catalogue_gains(block)}
    near = sorted(fits, key=lambda n: -gain[n])
    best = max([0.0, *gain.values()])
    error = {n: model.predict(fit.theta[:1])[1][0] for n, (model, fit) in fits.items()}
    rough = [n for n, e in error.items() if np.sqrt(np.mean((e / bulk.data.error[0]) ** 2)) > SHARE]
    near = [n for n in near if best - gain[n] < IN_PLAY or n in rough]
    near = [n for n in near if any(_trained(bulk.emulated, kind, n) for kind in bulk.kinds)]
    return {BASE: bulk.fit(())} | {name: fits[name] for name in near[:MOST]}


def _trained(emulated, experiment, mechanism):
    """Return whether runs of its own train a mechanism: it is no law of the reading and none that
    the base model's emulator predicts."""
    return hasattr(emulated.emulators.get((experiment, mechanism)), "error")


def left(bulk: Bulk, play: Mapping[str, tuple[Model, Fit]] | None = None) -> list[dict[str, Any]]:
    """[{experiment, mechanism, error, enough}] of all models in play, of `modes` unless given: the
    emulator's error at the mode over the measurement's, root mean square over an experiment's
    settings."""
    out = []
    for name, (model, fitted) in (play or modes(bulk)).items():
        error = model.predict(fitted.theta[:1])[1][0] / bulk.data.error[0]
        for kind in bulk.kinds:
            if name != BASE and not _trained(bulk.emulated, kind, name):
                continue
            own = error[[m.experiment == kind for m in bulk.measurements]]
            size = float(np.sqrt(np.mean(own**2)))
            out.append(
                {"experiment": kind, "mechanism": name, "error": size, "enough": size <= SHARE}
            )
    return out


def plan_wave(
    bulk: Bulk, rig: Rig, wave: int, trained: int
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]], list[dict[str, Any]]]:
    """Rows of a design, {run id: spec}, and what is left before these runs, of wave 1, 2, ...
    trained: runs of the first training."""
    play, rows, specs = modes(bulk), [], {}  # type: ignore[var-annotated]
    found = left(bulk, play)
    if wave > rig.settings.waves:
        return rows, specs, found
    rough = [one for one in found if not one["enough"]]
    for one, count in _within(rig.settings, rough, trained):
        model, fitted = play[one["mechanism"]]
        more, own = _near(rig, one["experiment"], model, fitted, wave, count)
        rows, specs = rows + more, specs | own
    return rows, specs, found


def _within(settings, rough, trained):
    """[(what is refined, its runs)] of the emulators that are too rough, best first: the base model
    has as many runs of a wave as all mechanisms together, and of these as many are refined as get
    LEAST_OF_A_WAVE."""
    base = [one for one in rough if one["mechanism"] == BASE]
    others = [one for one in rough if one["mechanism"] != BASE]
    wave = (LEARN * settings.runs - trained) / settings.waves
    of_base = wave * (OF_BASE if others else 1.0) if base else 0.0
    others = others[: max(int((wave - of_base) / LEAST_OF_A_WAVE), 1)]
    out = [(one, int(of_base / len(base))) for one in base]
    return out + [(one, int((wave - of_base) / len(others))) for one in others]


def _near(rig, experiment, model, fitted, wave, count):
    """Rows and specs of `count` runs of one emulator about the posterior mode of its model."""
    settings, names = rig.settings, model.mechanisms
    mechanism = names[0] if names else None
    label = mechanism.name if mechanism else BASE
    inputs = inputs_of(settings, model.factors, experiment, label)
    own = settings.experiments[experiment]
    theta = _draws(model, fitted, count, [settings.seed, wave, *f"{experiment}/{label}".encode()])
    levers = _where(model, fitted, experiment, count)
    rows, specs = [], {}
    for k, (at, given) in enumerate(zip(theta, levers, strict=True)):
        here = lever_values(settings, experiment, given)
        shares = _inputs(model, at, inputs, here, own)
        try:
            row, runs = row_of(rig, experiment, inputs, shares, mechanism, 1000 + SEEDS * wave + k)
        except SpecError:
            continue  # a law at this strength, say larger grains, does not fit the rig
        rows.append(row)
        specs |= runs
    return rows, specs


def _where(model, fitted, experiment, count):
    """Levers [{name: value}] of `count` runs: each is made at the measured setting where it takes
    most from the variance of the emulator over that of the reading."""
    theta, own = fitted.theta[0], [e == experiment for e, _ in model.conditions]
    emulator = model.predict(theta[None])[1][0]
    reading = np.sqrt(np.maximum(fitted.sd[0] ** 2 - emulator**2, 0.0))
    left = (emulator / reading)[own] ** 2
    run = (model.scatter(theta) / reading)[own] ** 2 + 1e-12
    levers, out = [x for e, x in model.conditions if e == experiment], []
    for _ in range(count):
        place = int(np.argmax(left**2 / (left + run)))
        left[place] *= run[place] / (left[place] + run[place])
        out.append(levers[place])
    return out


def _draws(model, fitted, count, label):
    """Parameters (count, p): a Latin hypercube through the posterior's normal, within the
    bounds."""
    rng = np.random.default_rng(label)
    normal = norm.ppf(qmc.LatinHypercube(fitted.theta.shape[1], rng=rng).random(count))
    # this root is the same everywhere; the signs of axes would be a library's choice
    cov = fitted.cov[0]
    root = np.linalg.cholesky(cov + 1e-9 * np.trace(cov) * np.eye(len(cov)))
    return np.clip(fitted.theta[0] + REACH * normal @ root.T, model.low, model.high)


def _inputs(model, theta, names, levers, own):
    """(d,) inputs of an emulator in [0, 1] at parameters theta (p,) and levers {name: value}."""
    at = {f.name: factor_share(t) for f, t in zip(model.factors, theta, strict=False)}
    for name, (low, high) in own.levers.items():
        at[name] = math.log(levers[name] / low) / math.log(high / low)
    return np.round([at.get(name, theta[-1]) for name in names], 6)  # last: the strength
