"""Waves: further runs of the engine where the posterior is, until an emulator's error there is
below half of the measurement's.

A first emulator is spread over whole ranges. A wave runs the base model and each mechanism that is
still in play at parameters drawn from the posterior that the emulators of the wave before give, at
the measured settings; the emulators are trained anew by all runs (Vernon, Goldstein, Bower 2010,
Bayesian Anal. 5:619). The number of waves and of runs in each is capped by the settings, and the
verdict says what is left.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import norm, qmc

from dem.errors import SpecError
from diagnosis.design import REFINE, factor_share, inputs_of, multiplied, row_of
from diagnosis.fit import data_of, evidence, fit
from diagnosis.settings import BASE, lever_values

if TYPE_CHECKING:
    from calibration.intake.measurements import Measurement
    from diagnosis.fit import Fit
    from diagnosis.model import Emulated, Model
    from diagnosis.rig import Rig


SHARE = 0.5
"""Error of an emulator over that of the measurement at which it is good enough."""

IN_PLAY = 5.0
"""Nats behind the best model (odds of 150 to 1) up to which a mechanism is still in play."""

MOST = 4  # mechanisms that are refined, best first
WITHIN = 2  # emulators that a wave of a budget refines: the base model's and the best
REACH = 1.5  # standard deviations of the posterior over which one of the draws spreads
SEEDS = 10_000  # between the seeds of two waves


def modes(emulated: Emulated, measurements: Sequence[Measurement]) -> dict[str, tuple[Model, Fit]]:
    """{name: (`Model`, `Fit`)} of the base model and of the mechanisms still in play, best first.

    One whose emulator is too rough to be judged by its score stays in play."""
    rows, tests, data = evidence(emulated, measurements)
    conditions = [m.condition for m in rows]
    models = {BASE: emulated.model(conditions, (), tests)}
    models |= {n: emulated.model(conditions, [n], tests) for n in emulated.applicable(conditions)}
    fits = {name: fit(model, data) for name, model in models.items()}
    score = {name: float(f.score[0]) for name, f in fits.items()}
    best = max(score.values())
    near = sorted((n for n in score if n != BASE), key=lambda n: -score[n])
    near = [n for n in near if best - score[n] < IN_PLAY or _rough(models[n], fits[n], data)]
    return {name: (models[name], fits[name]) for name in (BASE, *near[:MOST])}


def _rough(model, fitted, data):
    error = model.predict(fitted.theta[:1])[1][0]
    return np.sqrt(np.mean((error / data.error[0]) ** 2)) > SHARE


def left(
    emulated: Emulated,
    measurements: Sequence[Measurement],
    play: Mapping[str, tuple[Model, Fit]] | None = None,
) -> list[dict[str, Any]]:
    """[{experiment, mechanism, error, enough}] of all models in play, of `modes` unless given: the
    emulator's error at the mode over the measurement's, root mean square over an experiment's
    settings."""
    rows = [m for m in measurements if not m.outcome]
    measured, out = data_of(rows).error[0], []
    for name, (model, fitted) in (play or modes(emulated, measurements)).items():
        error = model.predict(fitted.theta[:1])[1][0] / measured
        for kind in dict.fromkeys(m.experiment for m in rows):
            if name != BASE and not hasattr(emulated.emulators.get((kind, name)), "error"):
                continue  # the base model's emulator, or a law of the reading
            own = error[[m.experiment == kind for m in rows]]
            size = float(np.sqrt(np.mean(own**2)))
            out.append(
                {"experiment": kind, "mechanism": name, "error": size, "enough": size <= SHARE}
            )
    return out


def plan_wave(
    emulated: Emulated, measurements: Sequence[Measurement], rig: Rig, wave: int
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]], list[dict[str, Any]]]:
    """Rows of a design, {run id: spec}, and what is left before these runs, of wave 1, 2, ..."""
    play, rows, specs = modes(emulated, measurements), [], {}  # type: ignore[var-annotated]
    found = left(emulated, measurements, play)
    if wave > rig.settings.waves:
        return rows, specs, found
    rough = [one for one in found if not one["enough"]]
    if rig.settings.runs is not None:
        rough = rough[:WITHIN]
    count = _count_within(rig.settings, len(rough))
    for one in rough:
        model, fitted = play[one["mechanism"]]
        more, own = _near(emulated, rig, one["experiment"], model, fitted, wave, count)
        rows, specs = rows + more, specs | own
    return rows, specs, found


def _count_within(settings, emulators):
    """Runs of each of the emulators that a wave refines, within the budget's share of one wave;
    None without a budget."""
    if settings.runs is None:
        return None
    return int(REFINE * settings.runs / settings.waves / max(emulators, 1))


def _near(emulated, rig, experiment, model, fitted, wave, count=None):
    """Rows and specs of one emulator's runs about the posterior mode of its model: `count` of
    them, as many as at first unless given."""
    settings, names = rig.settings, model.mechanisms
    mechanism = names[0] if names else None
    label = mechanism.name if mechanism else BASE
    inputs = inputs_of(settings, model.factors, experiment, label)
    own = settings.experiments[experiment]
    count = count or (own.runs_per_input or settings.runs_per_input) * len(inputs)
    theta = _draws(model, fitted, count, [settings.seed, wave, *f"{experiment}/{label}".encode()])
    levers = [x for e, x in model.conditions if e == experiment]
    # few runs go on where those of the wave before ended
    first = 0 if settings.runs is None else (wave - 1) * count
    lever = multiplied(settings, rig.factors, experiment, mechanism)
    rows, specs = [], {}
    for k, at in enumerate(theta):
        here = lever_values(settings, experiment, levers[(first + k) % len(levers)])
        shares = _inputs(model, at, inputs, here, own)
        try:
            row, runs = row_of(
                rig, experiment, inputs, shares, mechanism, 1000 + SEEDS * wave + k, lever
            )
        except SpecError:
            continue  # a law at this strength, say larger grains, does not fit the rig
        rows.append(row)
        specs |= runs
    return rows, specs


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
    at = dict(zip(model.names, theta, strict=True))
    out = []
    for name in names:
        if name in own.levers:
            low, high = own.levers[name]
            out.append(math.log(levers[name] / low) / math.log(high / low))
        elif name == "strength":
            out.append(at[model.mechanisms[0].name])
        else:
            out.append(factor_share(at[name]))
    return np.round(out, 6)
