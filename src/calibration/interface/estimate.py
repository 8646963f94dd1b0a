"""An answer in a minute: the parameters of a study as a distribution, from the runs of the atlas in
place of runs of its own."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pandas as pd
import yaml

from calibration.atlas.emulators import AtlasEmulators, cut_to_atlas, diameter_mm
from calibration.atlas.rigs import RIGS
from calibration.errors import CalibrationError
from calibration.figures import response_of
from calibration.stages.joint import sentences, write_posterior
from calibration.study.config import Config, overlay, parse_config
from calibration.study.config.joint import joint_targets, measured_of
from calibration.study.config.tests import spec_of
from calibration.study.factors import read_factors

if TYPE_CHECKING:
    from calibration.study.new.answers import Entry

GRAINS = 2000
"""Grains of a test at most, as `dem new --grains` has it: the atlas has heaps of no more."""


@dataclass(frozen=True)
class Estimate:
    """What the atlas tells of a study.

    summary: as joint.json of a study's joint stage; tables: parameters, targets, predictions, next,
    draws; said: sentences, what was cut and what was left out first.
    """

    summary: dict[str, Any]
    tables: dict[str, pd.DataFrame]
    said: list[str]
    factors: Sequence[Any]

    def write(self, folder: Path) -> None:
        """Write all of it and the figure into a new folder. Raises CalibrationError where it is
        there already."""
        if folder.exists():
            raise CalibrationError(f"{folder}: exists already; allowed: another folder (--out)")
        folder.mkdir(parents=True)
        files = {name: folder / f"{name}.csv" for name in self.tables}
        files |= {"pairs": folder / "pairs.svg", "summary": folder / "estimate.json"}
        write_posterior(self.factors, self.summary, self.tables, SimpleNamespace(**files))  # type: ignore[arg-type]  # as files of a rule


def estimate(config: Config) -> Estimate:
    """The `Estimate` of a study's measured tests. Raises CalibrationError where none of them is in
    the atlas, and naming what lies outside it."""
    from calibration.chain.joint.analysis import analysed, metrics_of  # loads the sampler

    factors, said = cut_to_atlas(config, read_factors(config.factors))
    emulators = AtlasEmulators(config, factors)
    measured = measured_of(config, joint_targets(config))
    told = emulators.told(measured)
    said += emulators.counted()
    said += [f"the atlas has no {t.name}: it is left out" for t in measured if t not in told]
    tests = {name: metrics_of(config, name, told) for name in emulators.tests}
    summary, tables = analysed(config, emulators, told, tests)  # type: ignore[arg-type]  # as Emulators
    said += [*sentences(summary, None), *_expected(tables["predictions"], told)]
    return Estimate(summary, tables, said, factors)


def _expected(predictions, measured):
    """Sentences on the readings that nobody made."""
    made = {pair for m in measured.values() for pair in zip(m.tests, m.metrics, strict=True)}
    for row in predictions.itertuples():
        if (row.rig, row.metric) not in made:
            shown = response_of(row.metric)
            yield (
                f"Expected of {row.rig}, {shown.name}: {shown.value(row.mean)} (95 %: "
                f"{shown.value(row.low)} to {shown.value(row.high)})"
            )


def estimate_of(entries: Sequence[Entry]) -> Estimate:
    """The `Estimate` of what a laboratory told, with a usual rig for each test of the atlas that it
    did not make. Raises CalibrationError."""
    from calibration.study.new.laboratory import laboratory_of
    from calibration.study.new.study import write_study

    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "estimate"
        said = write_study(laboratory_of("estimate", folder, entries, GRAINS))
        files = [folder / "config.yaml"]
        data = yaml.safe_load(files[0].read_text("utf-8"))
        data = with_usual_tests(data, parse_config(data, files=files))
        found = estimate(parse_config(data, files=files))
    # what a profile does with its grains is nothing here: no run is made
    return replace(found, said=[s for s in said if "profile" not in s] + found.said)


def with_usual_tests(data: Mapping[str, Any], config: Config) -> dict[str, Any]:
    """A configuration with a usual rig, the middle of the atlas, for each of its tests that the
    study has none of: what the study expects of them can then be told."""
    diameter = diameter_mm(spec_of(config, config.own))
    particles = config.own_run["particles"]
    shape = {k: particles[k] for k in ("elongation", "clump") if k in particles}
    experiments = {t.experiment for t in config.tests.values()}
    tests = {}
    for rig in (r for r in RIGS.values() if r.experiment not in experiments):
        at = {i.name: i.value(0.5) for i in rig.inputs} | {"elongation": 1.0}
        run = overlay(rig.run(at, diameter), {"particles": shape | {"diameter_mm": diameter}})
        tests[rig.name] = {"experiment": rig.experiment, "run": run}
    return overlay(data, {"tests": tests})
