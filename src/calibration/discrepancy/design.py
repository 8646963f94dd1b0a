"""Runs that teach the emulators: a Latin hypercube over parameters, levers and strength for each experiment and law."""

import numpy as np
from scipy.stats import qmc

from calibration.batches import named
from calibration.discrepancy.settings import BASE, condition_spec, log_span

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
    """Names of an emulator's inputs: parameters, levers, and `strength` unless it is the base model's."""
    own = settings.experiments[experiment].parameters
    names = [f.name for f in factors if f.name in own] + list(
        settings.experiments[experiment].levers
    )
    return names if mechanism == BASE else [*names, "strength"]


def plan(settings, base, factors, catalogue, experiments):
    """Rows [{experiment, mechanism, inputs in [0, 1], run_ids}], a point each, and {run id: spec} of all emulator runs.

    The points follow from the settings alone, not from the measurements, so another data set re-uses the runs; runs
    that repeat a point differ in their seed, so asking for more of them re-uses the first.
    """
    rows, specs = [], {}
    for experiment, mechanism in wanted(settings, catalogue, experiments):
        names = inputs_of(settings, factors, experiment, mechanism)
        label = f"{experiment}/{mechanism}"
        rng = np.random.default_rng([settings.seed, *label.encode()])
        sampler = qmc.LatinHypercube(len(names), rng=rng)
        own = settings.experiments[experiment]
        density = own.denser.get(mechanism, own.runs_per_input or settings.runs_per_input)
        for k, x in enumerate(np.round(sampler.random(density * len(names)), 6)):
            spec = _spec(
                settings, base, factors, experiment, names, x, catalogue.get(mechanism), 1000 + k
            )
            repeats = range(own.repeated.get(mechanism, 1))
            runs = named([spec | {"seed": spec["seed"] + REPEAT * j} for j in repeats])
            specs |= runs
            rows.append(
                {
                    "experiment": experiment,
                    "mechanism": mechanism,
                    "inputs": [float(v) for v in x],
                    "run_ids": list(runs),
                }
            )
    return rows, specs


def _spec(settings, base, factors, experiment, names, x, mechanism, seed):
    at = dict(zip(names, x, strict=True))
    ranges = settings.experiments[experiment].levers
    levers = {n: round(log_span(*ranges[n], at[n]), 6) for n in ranges}
    values = {f.name: f.natural(coded_factor(float(at[f.name]))) for f in factors if f.name in at}
    spec = condition_spec(base, settings, factors, experiment, levers, values, seed)
    if mechanism is None:
        return spec
    return mechanism.apply(spec, round(mechanism.strength.natural(float(at["strength"])), 12))


def coded_factor(share):
    """Coded level of a factor, -1 to 1 over its range, from a share in [0, 1] of the widened range."""
    return WIDENED * (2.0 * share - 1.0)


def factor_share(coded):
    """Share in [0, 1] of the widened range from a coded level."""
    return 0.5 * (coded / WIDENED + 1.0)
