"""An answer in a minute: the parameters of a study as a distribution, from the runs of the atlas in
place of runs of its own; and the ranges of a new study, by what the measurements leave of them in
the atlas and where the tests of its screening stand."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import yaml

from calibration.atlas.emulators import AtlasEmulators, cut_to_atlas, grain_of, poured_as_atlas
from calibration.atlas.rigs import RIGS, as_pair, grains_of_cone
from calibration.chain.joint.analysis import INSIDE, analysed, joint_of, metrics_of, tails
from calibration.errors import CalibrationError, ConfigError
from calibration.figures import response_of
from calibration.inference.joint.critique import ALPHA, POINTS, borders, misspecification
from calibration.stages.joint import atlas_against, sentences, write_posterior
from calibration.statistics.design import screening_design
from calibration.study.config import Config, overlay, parse_config
from calibration.study.config.tests import spec_of
from calibration.study.factors import Factor, read_factors
from calibration.study.new.answers import Entry
from calibration.study.new.laboratory import Laboratory, laboratory_of
from calibration.study.new.study import reach, write_study
from calibration.study.simulated_tests import WITH_SIZE
from dem.units import behind, unit_of, without_unit


@dataclass(frozen=True)
class Estimate:
    """What the atlas tells of a study.

    summary: as joint.json of a study's joint stage; tables: parameters, targets, predictions, next,
    draws; where no parameters meet the targets, targets alone; said: sentences.
    """

    summary: dict[str, Any]
    tables: dict[str, pd.DataFrame]
    said: list[str]
    factors: Sequence[Any]

    def write(self, folder: Path) -> None:
        """Write all of it, and the figure of the draws, into a new folder."""
        folder.mkdir(parents=True)
        files = {name: folder / f"{name}.csv" for name in self.tables}
        files |= {"pairs": folder / "pairs.svg", "summary": folder / "estimate.json"}
        write_posterior(self.factors, self.summary, self.tables, SimpleNamespace(**files))  # type: ignore[arg-type]  # as files of a rule


def estimate(config: Config) -> Estimate:
    """The `Estimate` of a study's measured tests. Raises CalibrationError where none of them is in
    the atlas, naming what lies outside it."""
    factors, said = cut_to_atlas(config, read_factors(config.factors))
    emulators = AtlasEmulators(config, factors)
    told, about = emulators.told()
    said += about
    tests = {name: metrics_of(config, name, told) for name in emulators.tests}
    summary, tables = analysed(config, emulators, told, tests)  # type: ignore[arg-type]  # as Emulators
    if summary["agreement"]["contradicts"]:
        own = {key: summary[key] for key in ("agreement", "targets", "misspecification_p")}
        said += atlas_against(own, None)
        return Estimate(own, {"targets": tables["targets"]}, said, factors)
    expected = tables["predictions"]
    expected["geometry"] = [_in_words(config, rig) for rig in expected["rig"]]
    rigs = expected.dropna(subset="mean")[["rig", "metric", "geometry"]]
    tables["next"] = tables["next"].merge(rigs)
    summary["next_test"] = tables["next"].to_dict("records")
    said += [*sentences(summary, None), *_foretold(expected, [(t.test, t.metric) for t in told])]
    return Estimate(summary, tables, said, factors)


def _in_words(config, test):
    """A test's rig: its grains, and what of its geometry has a unit."""
    told = {"grains_mm": grain_of(spec_of(config, test)).mm} | config.run_of(test)["geometry"]
    told = {without_unit(k).replace("_", " "): (v, unit_of(k)) for k, v in told.items()}
    return ", ".join(f"{k} {v:.3g}{behind(unit)}" for k, (v, unit) in told.items() if unit)


def _foretold(expected, made):
    """Sentences on the readings that nobody made."""
    for row in (r for r in expected.itertuples() if (r.rig, r.metric) not in made):
        shown = response_of(row.metric)
        what = f"{row.rig}, {shown.name} ({row.geometry})"
        ends = f"(95 %: {shown.value(row.low)} to {shown.value(row.high)})"
        none = f"The atlas does not tell {what}: most draws give no value that is possible"
        yield none if np.isnan(row.mean) else f"Expected of {what}: {shown.value(row.mean)} {ends}"


def estimate_of(entries: Sequence[Entry]) -> Estimate:
    """The `Estimate` of what a laboratory told, with a usual rig for each test of the atlas that it
    did not make. Raises CalibrationError."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "estimate"
        # grains of a test at most, as of `dem new --grains`: a cone on the atlas' widest plate
        most = round(grains_of_cone(RIGS["heap"].input("plate").high))
        lab = laboratory_of("estimate", folder, entries, most, single=True)
        said = write_study(lab)
        files = [folder / "config.yaml"]
        data = with_usual_tests(yaml.safe_load(files[0].read_text("utf-8")), lab)
        config, poured = poured_as_atlas(parse_config(data, files=files))
        found = estimate(config)
    # what a profile does with its grains is nothing here: no run is made
    return replace(found, said=[s for s in [*said, *poured] if "profile" not in s] + found.said)


def with_usual_tests(data: Mapping[str, Any], lab: Laboratory) -> dict[str, Any]:
    """A study's configuration with what a test tells of a parameter by itself as its prior in place
    of the test; and of the laboratory's own grains a usual rig, the middle of the atlas, for each
    test that it did not make, so that what is expected of it can be told. A drum of grains that
    stick is none of these: they turn as a block, which has no surface to read."""
    grains, tests, priors = lab.grains, dict(data["tests"]), {}
    for test in lab.tests:
        for f in (f for f in lab.factors if f.key in test.known):
            mean, sd = test.known[f.key]
            priors[f.name] = {"mean": mean, "sd": sd, "source": f.description}
            tests.pop(test.rig)
    made = {t.experiment for t in lab.tests} | ({"drum"} if grains.sticky else set())
    mm = grains.common_mm or grains.diameter_mm
    own = {"diameter_mm": mm} | ({"clump": {"file": grains.clump_file}} if grains.spheres else {})
    longer = as_pair(grains.longest) if grains.spheres else 1.0
    for rig in (r for r in RIGS.values() if r.experiment not in made):
        at = {i.name: i.value(0.5) for i in rig.inputs} | {"elongation": longer}
        run = overlay(rig.run(at, mm), {"particles": own})
        tests[rig.name] = {"experiment": rig.experiment, "run": run}
    return {**data, "tests": tests, "posterior": {"priors": priors}}


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
        measured, about = emulators.told()
    except (CalibrationError, ConfigError) as error:
        return list(factors), [f"the ranges stay as they are: {error}"], []
    joint = joint_of(config, emulators, measured)  # type: ignore[arg-type]  # as Emulators
    sides, tests, said = zip(*_reached(config, joint, measured), strict=True)
    why, low, high = "", np.zeros(len(own)), np.ones(len(own))
    inner = low + LEAST, high - LEAST
    if any(sides) or (len(sides) > 1 and misspecification(joint, seed=config.seed) < ALPHA):
        why = "in the atlas hardly any of their parameters give all that was measured"
        if short:  # what lies beyond it may give that
            why, said, tests = f"{why}, and it ends within them", (), ()
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
    said = [*said, *first, *about, *(f"{f.name}: {f.levels} becomes {n.levels}" for f, n in pairs)]
    if why:
        where = "are cut only to where tests have a value" if pairs else "stay as they are"
        said.append(f"the ranges {where}: {why}")
    return cut, said, list(tests)


def _reached(config, joint, measured):
    """(side, test, sentence) of each target: what the atlas gives over the ranges, by KEPT, and
    whether all of that lies below the measured value (1), above it (-1) or about it (0)."""
    rng = np.random.default_rng(config.seed)
    u = joint.prior.draw(POINTS, rng)
    for response, target in zip(joint.responses, measured, strict=True):
        test, metric, y = target.test, target.metric, response.mean
        values, variance = response.predicted(u)
        low, high = tails(rng.normal(values, np.sqrt(variance)), KEPT)
        error, shown = 2.0 * np.sqrt(response.variance), response_of(metric)
        side = int(y - error > high) - int(y + error < low)
        given = f"{shown.name} {shown.value(max(low, 0.0))} to {shown.value(high)}"
        told = f"measured {shown.value(y)}: {reach(config, test, metric, side)}"
        yield side, test, f"{test}: {given} over the ranges, by the atlas; {told}"


def _wide_enough(low, high):
    """Ends of ranges in [0, 1], moved apart where less than LEAST stays between them."""
    middle = np.clip(0.5 * (low + high), 0.5 * LEAST, 1.0 - 0.5 * LEAST)
    return np.minimum(low, middle - 0.5 * LEAST), np.maximum(high, middle + 0.5 * LEAST)


def _standing(config, factors, emulators, low, high, inner):
    """Ends moved in until each test of the screening has a value as likely as not: one after the
    other to the `inner` ones, those first at which most tests have none. How much grains stick is
    not cut: the atlas ends where heaps still form."""
    chance = emulators.formed(config.own, config.target, 1).chance
    design = screening_design(factors, config.screening)[[f.code for f in emulators.factors]]
    corners = 0.5 + 0.5 * design.drop_duplicates().to_numpy(float)
    tops = np.eye(len(low))
    rises = chance.predict(tops)[0] - chance.predict(0.0 * tops)[0]
    sticky = [k for k, f in enumerate(emulators.factors) if f.key in WITH_SIZE]
    for k in (k for k in np.argsort(-np.abs(rises)) if k not in sticky):
        if (chance.predict(low + corners * (high - low))[0] <= 0.0).all():
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
