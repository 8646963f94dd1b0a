"""Runs that train the emulators: a Latin hypercube over parameters, levers and strength for each
experiment and law."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from calibration.intake.quantities import POURED, Condition
from calibration.runs.simulated import named
from diagnosis.catalogue import Strength
from diagnosis.settings import BASE, log_span

REPEAT = 100_000  # between the seeds of runs that repeat a point
WIDENED = 1.15  # the emulators reach a little beyond the factors' range, so that a fit may


def wanted(settings, catalogue, experiments):
    """[(experiment, mechanism name or BASE)] that need runs of their own."""
    pairs = [(e, BASE) for e in experiments]
    for m in catalogue.values():
        for e in m.experiments if m.observe is None else ():
            chosen = settings.experiments[e].mechanisms if e in experiments else []
            if chosen is None or m.name in chosen:
                pairs.append((e, m.name))
    return pairs


def inputs_of(settings, factors, experiment, mechanism):
    """Names of an emulator's inputs: parameters, levers, and `strength` unless it is the base
    model's."""
    own = settings.experiments[experiment].parameters
    names = [f.name for f in factors if f.key in own] + list(
        settings.experiments[experiment].levers
    )
    return names if mechanism == BASE else [*names, "strength"]


@dataclass(frozen=True)
class MultipliedLever:
    """What a mechanism does that multiplies a lever: it moves the lever's input, `column`, by the
    logarithm of its strength over `span`, that of the ratio of the range's ends."""

    column: int
    span: float
    strength: Strength

    def moved(self, x):
        """Inputs (k, d) of the base model from those (k, d + 1) of the mechanism, the coded
        strength last."""
        out = x[:, :-1].copy()
        out[:, self.column] += np.log(self.strength.natural(x[:, -1])) / self.span
        return out

    def slope(self, x):
        """Derivative (k,) of the moved input by the coded strength."""
        return self.strength.slope(x[:, -1]) / self.strength.natural(x[:, -1]) / self.span


def multiplied(settings, factors, experiment, mechanism):
    """`MultipliedLever` of a mechanism in an experiment, None where it has none or the lever is not
    all that changes.

    A rig is filled with a volume of grains unless their number is a lever, too: then another size
    is another number."""
    levers = settings.experiments[experiment].levers
    if mechanism is None or mechanism.multiplies not in levers:
        return None
    if experiment in POURED and "particle_count" not in levers:
        return None
    low, high = levers[mechanism.multiplies]
    column = inputs_of(settings, factors, experiment, BASE).index(mechanism.multiplies)
    return MultipliedLever(column, math.log(high / low), mechanism.strength)


def plan(rig, catalogue, experiments):
    """Rows [{experiment, mechanism, inputs in [0, 1], run_ids}], a point each, and {run id: spec}
    of all emulator runs.

    Rows of a mechanism that multiplies a lever are rows of the base model. The input of this lever
    may leave [0, 1].

    The points follow from the settings alone and not from the measurements, so another data set
    re-uses the runs. Runs that repeat a point differ in their seed, so a larger number of them
    re-uses the first.
    """
    rows, specs, settings, factors = [], {}, rig.settings, rig.factors
    for experiment, mechanism in wanted(settings, catalogue, experiments):
        names = inputs_of(settings, factors, experiment, mechanism)
        lever = multiplied(settings, factors, experiment, catalogue.get(mechanism))
        for k, x in enumerate(_points(settings, experiment, mechanism, len(names))):
            law = catalogue.get(mechanism)
            row, runs = row_of(rig, experiment, names, x, law, 1000 + k, lever)
            rows.append(row)
            specs |= runs
    return rows, specs


def row_of(rig, experiment, names, x, mechanism, seed, lever=None):
    """A row of a design, a mapping, and {run id: spec} of its runs at inputs x (d,) in [0, 1].

    mechanism: a `Mechanism`, None for the base model; lever: its `MultipliedLever`, if it has
    one."""
    label = mechanism.name if mechanism else BASE
    spec = _spec(rig, experiment, names, x, mechanism, seed)
    repeats = range(rig.settings.experiments[experiment].repeated.get(label, 1))
    runs = named([spec | {"seed": spec["seed"] + REPEAT * j} for j in repeats])
    row = {
        "experiment": experiment,
        "mechanism": BASE if lever else label,
        "inputs": [float(v) for v in (lever.moved(x[None])[0] if lever else x)],
        "run_ids": list(runs),
    }
    return row, runs


def _points(settings, experiment, mechanism, inputs):
    """Points (k, inputs) in [0, 1]: one Latin hypercube after the other, so asking for more keeps
    the first."""
    own = settings.experiments[experiment]
    density = own.denser.get(mechanism, own.runs_per_input or settings.runs_per_input)
    label = [settings.seed, *f"{experiment}/{mechanism}".encode()]
    cubes = []
    for k in range(own.hypercubes.get(mechanism, 1)):
        rng = np.random.default_rng(label + [k] * (k > 0))
        cubes.append(qmc.LatinHypercube(inputs, rng=rng).random(density * inputs))
    return np.round(np.vstack(cubes), 6)


def _spec(rig, experiment, names, x, mechanism, seed):
    at = dict(zip(names, x, strict=True))
    ranges = rig.settings.experiments[experiment].levers
    levers = {n: round(log_span(*ranges[n], at[n]), 6) for n in ranges}
    varied = [f for f in rig.factors if f.name in at]
    values = {f.name: f.natural(coded_factor(float(at[f.name]))) for f in varied}
    spec = rig.spec(Condition(experiment, levers), seed, values)
    if mechanism is None:
        return spec
    return mechanism.apply(spec, round(mechanism.strength.natural(float(at["strength"])), 12))


def coded_factor(share):
    """Coded level of a factor, -1 to 1 over its range, from a share in [0, 1] of the widened
    range."""
    return WIDENED * (2.0 * share - 1.0)


def factor_share(coded):
    """Share in [0, 1] of the widened range from a coded level."""
    return 0.5 * (coded / WIDENED + 1.0)
