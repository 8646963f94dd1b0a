"""Runs of a joint study: one design for all rigs, and points added where the posterior is wide.

The chain of screening, ascent and surface spends its runs on the way to one target; this stage
spends its own over the whole levels of all factors.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from sklearn.cluster import KMeans

from calibration.chain.joint.emulators import Emulators, free_factors, joint_of
from calibration.inference.joint.critique import thinned
from calibration.intake.tables import read_written
from calibration.runs.plans import together, write_plan
from calibration.statistics.space_filling import space_filling
from calibration.statistics.ties import first_least
from calibration.study.config.joint import (
    joint_targets,
    joint_tests,
    measured_of,
    refined_tests,
)
from calibration.study.simulated_tests import simulated
from dem.experiments import experiments

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.config import Config


def plan_joint_first(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan one space-filling design over the free factors (scrambled Sobol points) for every rig,
    the first `joint.repeated` points twice where runs of the rig scatter."""
    config, factors, parts = study.config, free_factors(study), []
    for rig in joint_tests(config):
        points = first_points(config, rig, len(factors))
        parts.append(_planned(study, rig, factors, points, 0))
    write_plan(Path(output.plan).parent, *_numbered(parts))


def plan_joint(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The design of all runs, and the plan of those that are added: `joint.second_wave` points
    spread over the posterior that the first runs, finished by now, give. They are for the rigs of
    the targets and for `joint.machine`."""
    config, factors = study.config, free_factors(study)
    first, parts = read_written(source.first), []
    if config.joint.second_wave:
        measured = measured_of(config, joint_targets(config))
        draws = joint_of(config, Emulators(factors, first), measured).posterior(config.seed).draws
        points = _spread(draws, config.joint.second_wave, config.seed)
        before = config.joint.runs + config.joint.repeated
        for rig in refined_tests(config):
            parts.append(_planned(study, rig, factors, points, before))
    table, specs = _numbered([(first.drop(columns="run"), {}), *parts])
    made = set(first["run_id"])
    added = {name: spec for name, spec in specs.items() if name not in made}
    write_plan(Path(output.plan).parent, table, added)


def first_points(config: Config, rig: str, d: int) -> np.ndarray:
    """Return the points (n, d) in [0, 1] of the first runs of a rig, for d free factors."""
    points = space_filling(config.joint.runs, d, config.seed)
    scatters = experiments()[config.tests[rig].experiment].poured
    return np.concatenate([points, points[: config.joint.repeated if scatters else 0]])


def _planned(study, rig, factors, u, before):
    """Table and specs of the runs of a rig at u (n, d), each with a seed of its own: one seed for
    all would shift all of them alike, and no repeated point would show it. before: seeds that the
    rig's other runs have."""
    config, test = study.config, simulated(study.config, rig)
    levels = {f.name: np.round(f.natural(2.0 * u[:, k] - 1.0), 9) for k, f in enumerate(factors)}
    design = pd.DataFrame({"rig": rig} | levels)
    parts = [
        study.plan_test(design.iloc[[n]], test, config.seed + before + n)
        for n in range(len(design))
    ]
    return together(parts)


def _numbered(parts):
    """Tables and specs as one of each, a row a run."""
    table, specs = together(parts)
    table = table.drop_duplicates("run_id", ignore_index=True)
    return table.assign(run=np.arange(1, len(table) + 1)), specs


def _spread(draws, count, seed):
    """Points (count, d) spread over draws (k, d): the nearest draw to each centre of clusters."""
    some = thinned(draws)
    centres = KMeans(min(count, len(some)), n_init=1, random_state=seed).fit(some).cluster_centers_
    apart = ((centres[:, None] - some[None]) ** 2).sum(axis=2)
    return some[np.unique([first_least(row) for row in apart])]  # a pair is as near to its centre
