"""Runs that train the emulators: a Latin hypercube over parameters, levers and strength for each
experiment and law."""

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import qmc

from calibration.errors import ConfigError
from calibration.intake.quantities import Condition
from calibration.runs.simulated import named
from calibration.study.factors import Factor
from dem.errors import SpecError
from diagnosis.catalogue import Mechanism
from diagnosis.rig import Rig
from diagnosis.settings import BASE, Settings, log_span

REPEAT = 100_000  # between the seeds of runs that repeat a point
WIDENED = 1.15  # the emulators reach a little beyond the factors' range, so that a fit may


def possible(
    rig: Rig, catalogue: Mapping[str, Mechanism], experiments: Collection[str]
) -> list[tuple[str, str]]:
    """[(experiment, mechanism name or BASE)] that need runs of their own and that the study's
    engine can represent."""
    pairs = [(e, BASE) for e in experiments]
    for m in catalogue.values():
        for e in m.experiments if m.observe is None else ():
            chosen = rig.settings.experiments[e].mechanisms if e in experiments else []
            if (chosen is None or m.name in chosen) and not rig.refuses(e, m):
                pairs.append((e, m.name))
    return pairs


TRAIN, LEARN = 0.5, 0.8
"""Shares of a budget of runs that train the emulators, at most, and that train and refine them; the
rest measures the gain."""

ENOUGH = 12
"""Runs for each of its inputs that train the base model's emulator, at most. Waves have the rest: a
run about the best point decides more."""

REPEATED = 4
"""One of so many of the base model's runs repeats a point with another seed: runs at points of
their own do not tell how much runs scatter."""

OF_BASE = 0.5
"""Share of a budget's training, and of each wave, that the base model has; the mechanisms that need
runs of their own have the rest alike."""

LEAST_OF_A_MECHANISM = 3
"""Runs of a mechanism's emulator, at least: they train what it adds to the base model."""


def budgeted(
    rig: Rig, catalogue: Mapping[str, Mechanism], experiments: Collection[str]
) -> dict[tuple[str, str], int]:
    """{(experiment, mechanism): runs} of the first training within `settings.runs`, of the pairs of
    `possible`. Raises ConfigError for a budget that is too small, with the least that is enough."""
    settings, pairs = rig.settings, possible(rig, catalogue, experiments)
    counts, least = dict.fromkeys(pairs, 0), 0
    if not pairs:
        return counts
    whole = int(TRAIN * settings.runs / len(experiments))  # type: ignore[operator]  # `setup` fills it in
    for kind in experiments:
        others = [name for e, name in pairs if e == kind and name != BASE]
        inputs = len(inputs_of(settings, rig.factors, kind, BASE))
        own = min(whole, int(ENOUGH * inputs / OF_BASE))
        fewest, few = inputs + 2, LEAST_OF_A_MECHANISM
        least = max(least, fewest + few * len(others))
        for_others = min(int((1.0 - OF_BASE) * own), own - fewest)
        each = max(few, for_others // max(len(others), 1))
        counts |= {(kind, name): each for name in others}
        counts[kind, BASE] = own - each * len(others)
        if counts[kind, BASE] < fewest:
            counts[kind, BASE] = 0
    if 0 in counts.values():
        needed = math.ceil(least * len(experiments) / TRAIN)
        reason = "is too small a budget for the experiments, coefficients and mechanisms"
        allowed = f"at least {needed} runs, or fewer `mechanisms` or `parameters` of an experiment"
        key = "diagnosis.minutes" if settings.minutes else "diagnosis.runs"
        raise ConfigError(reason, key=key, value=f"{settings.runs} runs", allowed=allowed)
    return counts


def trained(rig: Rig, catalogue: Mapping[str, Mechanism], experiments: Collection[str]) -> int:
    """Return the number of runs of the first training."""
    return sum(budgeted(rig, catalogue, experiments).values())


def inputs_of(
    settings: Settings, factors: Sequence[Factor], experiment: str, mechanism: str
) -> list[str]:
    """Names of an emulator's inputs: parameters, levers, and `strength` unless it is the base
    model's."""
    own = settings.experiments[experiment].parameters
    names = [f.name for f in factors if f.key in own] + list(  # type: ignore[operator]  # `setup` fills it in
        settings.experiments[experiment].levers  # type: ignore[arg-type]  # `setup` fills it in
    )
    return names if mechanism == BASE else [*names, "strength"]


REFUSED = 0.5
"""Share of the base model's points that the engine may refuse: corners of the levers' ranges, such
as the largest grains at the narrowest orifice, which nobody measured."""


def plan(
    rig: Rig, catalogue: Mapping[str, Mechanism], experiments: Collection[str]
) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
    """Rows [{experiment, mechanism, inputs in [0, 1], run_ids}], a point each, and {run id: spec}
    of all emulator runs.

    The points follow from the settings alone and not from the measurements, so another data set
    re-uses the runs.
    """
    rows, specs, settings = [], {}, rig.settings  # type: ignore[var-annotated]
    for (experiment, mechanism), count in budgeted(rig, catalogue, experiments).items():
        names = inputs_of(settings, rig.factors, experiment, mechanism)
        rng = np.random.default_rng([settings.seed, *f"{experiment}/{mechanism}".encode()])
        points = qmc.LatinHypercube(len(names), rng=rng).random(count)
        own = settings.experiments[experiment]
        points = np.round(_at_levels(own, points, int(mechanism != BASE)), 6)
        if mechanism != BASE:
            points = _strong(points, catalogue[mechanism].strength)
        law, refused = catalogue.get(mechanism), []
        # the base model's points are two more than the inputs at least
        again = 0 if law else max(min(count // REPEATED, count - len(names) - 2), 0)
        points = points[: len(points) - again]
        for k, x in enumerate(points):
            try:
                times = 2 if k < again else 1
                row, runs = row_of(rig, experiment, names, x, law, 1000 + k, times)
            except SpecError as error:
                refused.append(error)  # larger grains that overfill the rig, say
                continue
            rows.append(row)
            specs |= runs
        if law is None and len(refused) > REFUSED * len(points):
            raise ConfigError(
                f"{experiment}: {len(refused)} of {len(points)} points over the ranges of the "
                f"levers and the coefficients cannot be run, the first as {refused[0]}",
                key=f"diagnosis.experiments.{experiment}",
                allowed="a rig in which the measured levels go together, or narrower `levers`",
            )
    return rows, specs


def row_of(
    rig: Rig,
    experiment: str,
    names: Sequence[str],
    x: np.ndarray,
    mechanism: Mechanism | None,
    seed: int,
    times: int = 1,
) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """A row of a design, a mapping, and {run id: spec} of its runs at inputs x (d,) in [0, 1].

    mechanism: a `Mechanism`, None for the base model; times: runs, of other seeds."""
    at = dict(zip(names, x, strict=True))
    ranges: Any = rig.settings.experiments[experiment].levers  # `setup` fills it in
    levers = {n: round(log_span(low, high, at[n]), 6) for n, (low, high) in ranges.items()}
    # from shares of the widened range to levels, -1 to 1 over a factor's range
    coded = {name: WIDENED * (2.0 * float(share) - 1.0) for name, share in at.items()}
    values = {f.name: f.natural(coded[f.name]) for f in rig.factors if f.name in at}
    spec = rig.spec(Condition(experiment, levers), seed, values)
    if mechanism:
        strength = mechanism.strength.natural(float(at["strength"]))
        spec = mechanism.apply(spec, round(strength, 12))
    runs = named([spec | {"seed": spec["seed"] + REPEAT * j} for j in range(times)])
    row = {
        "experiment": experiment,
        "mechanism": mechanism.name if mechanism else BASE,
        "inputs": [float(v) for v in x],
        "run_ids": list(runs),
    }
    return row, runs


NEAR = 0.15
"""Coded strengths that count as next to where a mechanism does nothing."""


def _at_levels(own, x, behind):
    """Points x (k, inputs) with the levers at the levels of the settings, each as often as the
    others; the levers stand last, before `behind` further inputs."""
    out, first = x.copy(), x.shape[1] - behind - len(own.levers)
    for column, (name, (low, high)) in enumerate(own.levers.items(), first):
        levels = own.levels.get(name)
        if levels:
            place = (x[:, column] * len(levels)).astype(int)
            out[:, column] = np.log(np.array(levels)[place] / low) / math.log(high / low)
    return out


def _strong(points, strength):
    """Points (k, d) with strengths that are not next to where the mechanism does nothing, for there
    a run says little of what it adds. As they are where that is at no end."""
    if strength.log and strength.off is None:
        return points  # it is nowhere off
    off = strength.weakest
    if min(abs(off), abs(off - 1.0)) > 1e-9:
        return points
    out = points.copy()
    far = 1.0 - NEAR
    out[:, -1] = np.round(NEAR + far * points[:, -1] if off < 0.5 else far * points[:, -1], 6)
    return out


def factor_share(coded: Any) -> Any:
    """Share in [0, 1] of the widened range from a coded level."""
    return 0.5 * (coded / WIDENED + 1.0)
