"""The ranges of a new study by the atlas: what the measurements leave of them, and of that where
the tests of its screening stand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.atlas.emulators import AtlasEmulators, cut_to_atlas, poured_as_atlas
from calibration.chain.joint.analysis import INSIDE, joint_of
from calibration.errors import CalibrationError
from calibration.figures import response_of
from calibration.inference.joint.critique import ALPHA, POINTS, borders, misspecification
from calibration.statistics.screening_design import screening_design
from calibration.study.config import Config
from calibration.study.config.joint import joint_targets, measured_of
from calibration.study.factors import Factor
from calibration.study.new.pilot import reach
from calibration.study.simulated_tests import WITH_SIZE

KEPT = 0.99
"""Level of the interval that stays of a range: the study's own runs tell an end that was left too
far out, and never one that was cut off."""
STANDS = 0.9
"""Level of the interval that stays where more is cut so that tests stand."""
LEAST = 0.5
"""Of a range that stays. An effect goes with its range: four screenings of heaps of 1,500 grains
tell 1.2° (two standard errors), and the effects that decide are of 3° and more."""


def ranges_by_atlas(
    config: Config, factors: Sequence[Factor]
) -> tuple[list[Factor], list[str], list[str]]:
    """(factors with the ranges that the atlas leaves, sentences, tests of which these say whether
    the ranges reach what was measured). Ranges stay where the atlas refuses the study; where it has
    nothing in them of what was measured, they are cut only to where tests have a value."""
    try:
        config, first = poured_as_atlas(config)
        own, short = cut_to_atlas(config, factors)
        emulators = AtlasEmulators(config, own)
        read = measured_of(config, joint_targets(config))
        measured = emulators.told(read)
    except CalibrationError as error:
        return list(factors), [f"the ranges stay as they are: {error}"], []
    joint = joint_of(config, emulators, measured)  # type: ignore[arg-type]  # as Emulators
    tests = [test for mean in measured.values() for test in mean.tests]
    sides, said = zip(*_reached(config, joint, measured), strict=True)
    why, low, high = "", np.zeros(len(own)), np.ones(len(own))
    inner = low + LEAST, high - LEAST
    if any(sides) or (len(sides) > 1 and misspecification(joint, seed=config.seed) < ALPHA):
        why = "in the atlas hardly any of their parameters give all that was measured"
        if short:  # what lies beyond it may give that
            why, said, tests = f"{why}, and it ends within them", (), []
    else:
        posterior = joint.posterior(config.seed)
        if short and borders(posterior.draws, joint.prior):
            why = "the atlas ends within them, and the measurements press on an end"
    if not why:
        low, high = _wide_enough(*posterior.interval(KEPT))
        low, high = np.where(low > INSIDE, low, 0.0), np.where(high < 1.0 - INSIDE, high, 1.0)
        inner = _wide_enough(*posterior.interval(STANDS))
    if config.own in emulators.tests:
        low, high = _standing(config, factors, emulators, low, high, inner)
    ends = {f.name: (f, *pair) for f, *pair in zip(own, low, high, strict=True)}
    cut = [_narrowed(f, *ends[f.name]) if f.name in ends else f for f in factors]
    pairs = [(f, new) for f, new in zip(factors, cut, strict=True) if f != new]
    said = [*said, *first, *emulators.left_out(read)]
    said += [f"{f.name}: {f.levels} becomes {new.levels}" for f, new in pairs]
    if why:
        where = "are cut only to where tests have a value" if pairs else "stay as they are"
        said.append(f"the ranges {where}: {why}")
    return cut, said, tests


def _reached(config, joint, measured):
    """(side, sentence) of each target: what the atlas gives over the ranges, by KEPT, and whether
    all of that lies below the measured value (1), above it (-1) or about it (0)."""
    rng = np.random.default_rng(config.seed)
    u = joint.prior.draw(POINTS, rng)
    for response, mean in zip(joint.responses, measured.values(), strict=True):
        (test,), (metric,), (y,) = mean.tests, mean.metrics, response.mean
        values, variance = response.predicted(u)
        tails = 0.5 - 0.5 * KEPT, 0.5 + 0.5 * KEPT
        low, high = np.quantile(rng.normal(values, np.sqrt(variance)), tails)
        error, shown = 2.0 * np.sqrt(response.covariance[0, 0]), response_of(metric)
        side = int(y - error > high) - int(y + error < low)
        given = f"{shown.name} {shown.value(max(low, 0.0))} to {shown.value(high)}"
        told = f"measured {shown.value(y)}: {reach(config, test, metric, side)}"
        yield side, f"{test}: {given} over the ranges, by the atlas; {told}"


def _wide_enough(low, high):
    """Ends of ranges in [0, 1], moved apart where less than LEAST stays between them."""
    middle = np.clip(0.5 * (low + high), 0.5 * LEAST, 1.0 - 0.5 * LEAST)
    return np.minimum(low, middle - 0.5 * LEAST), np.maximum(high, middle + 0.5 * LEAST)


def _standing(config, factors, emulators, low, high, inner):
    """Ends moved in until each test of the screening has a value as likely as not: one after the
    other to the `inner` ones, those first at which most tests have none. How much grains stick is
    not cut: the atlas ends where heaps still form."""
    chance = emulators.formed(config.own, [config.target.metric], 1).chance
    design = screening_design(factors, config.screening)[[f.code for f in emulators.factors]]
    corners = 0.5 + 0.5 * design.drop_duplicates().to_numpy(float)
    tops = np.eye(len(low))
    rises = chance.with_slope(tops, [])[0] - chance.with_slope(0.0 * tops, [])[0]
    sticky = [k for k, f in enumerate(emulators.factors) if f.key in WITH_SIZE]
    for k in (k for k in np.argsort(-np.abs(rises)) if k not in sticky):
        if (chance.with_slope(low + corners * (high - low), [])[0] <= 0.0).all():
            break
        if rises[k] > 0.0:
            high[k] = min(high[k], inner[1][k])
        else:
            low[k] = max(low[k], inner[0][k])
    return low, high


def _narrowed(factor, own, low, high):
    """A factor between the ends `low` and `high` in [0, 1] of `own`, its range in the atlas; an end
    that stays is that of the factor, whether the atlas reaches it or not."""
    span = own.high - own.low
    new_low = float(f"{own.low + low * span:.3g}") if low > 0.0 else factor.low
    new_high = float(f"{own.low + high * span:.3g}") if high < 1.0 else factor.high
    if (new_low, new_high) == (factor.low, factor.high):
        return factor
    note = f"{factor.description}; narrowed from {factor.levels} by the atlas"
    return replace(factor, low=new_low, high=new_high, description=note)
