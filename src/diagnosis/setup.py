"""What the stages of a diagnosis share, made once of a study and the settings of the diagnosis: the
checked table, the rig, and how an experiment is simulated where the settings do not say it.

That is derived from the study's run spec, its rigs, its table of factors and the table of
measurements. Nothing is guessed. What follows from none of these is a fault that names the line of
the first measurement and the key to give.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from calibration.chain.study import Study
from calibration.errors import ConfigError
from calibration.files import read_json
from calibration.intake.measurements import Measurement, raise_faults
from calibration.intake.quantities import QUANTITIES, levers_of, measurable
from calibration.runs.simulated import simulate, untested
from calibration.study.config import Config, overlay
from calibration.study.config.specs import with_levels
from calibration.study.cost import duration, run_seconds
from calibration.study.factors import Factor, read_factors
from dem.errors import SpecError
from dem.experiments import experiments
from diagnosis.emulator import as_tests, train, train_failures
from diagnosis.lever_laws import lever_laws, with_laws
from diagnosis.measurements import alone, read_all
from diagnosis.model import Emulated
from diagnosis.page.words import told
from diagnosis.rig import Rig
from diagnosis.settings import (
    RIG,
    Experiment,
    Settings,
    catalogue_of,
    check_levers,
    of_run,
    parameters_of,
)

MINUTES, CORES = 60.0, 2
"""Time of a diagnosis with emulated experiments, unless the settings give it, and the cores that it
is told of."""

MOST_RUNS = 400
"""Runs of an experiment within that time at most: more bring little, and emulators grow slow."""

RUNS, MORE_RUNS = 80, 40
"""Runs with one emulated experiment, and of each further one, where the settings give no time and
these take longer, or where nothing tells how long runs take."""

MOST_LEVELS = 10
"""Levels of a lever up to which the runs that train emulators are made at these alone."""

ENDED = "arched"
"""Metric of a run that is 1 where it ended as a test with an outcome ends. A silo that arches has
let some grains out, of which the run reads a flow; the laboratory writes `clogged`."""

MOST = 4
"""Coefficients that are calibrated on an experiment: each more asks for more runs."""

GIVEN = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
"""coefficients: keys that a bulk test may depend on, in the order in which they are taken: a heap's
angle, a flow and a yield locus follow the grains' own friction first, and a restitution last.

single: of single contacts the one coefficient that each depends on, and how it is simulated: a drop
at so many phases of a time step, for few scatter alike at all settings of a height; a tilt of
grains bonded wide apart, for a square of touching ones tips at 45 degrees."""


def completed(
    settings: Settings,
    config: Config,
    factors: Sequence[Factor],
    measurements: Sequence[Measurement],
    path: str | Path,
) -> Settings:
    """`Settings` in which every experiment of the measurements is described in full, the ranges of
    its levers as wide as these are.

    settings: `Settings` as they were given; config: the study's `Config`; factors: its `Factor`s;
    measurements: every row of its table with a value, `Measurement`s; path: of the table.
    Raises ConfigError, one message a fault, for an experiment without a rig or a parameter, and for
    a lever that some rows leave empty and the run spec does not have.
    """
    kinds = list(dict.fromkeys(m.experiment for m in measurements))
    if settings.runs and settings.minutes:
        allowed = "one of `minutes` and `runs`"
        raise ConfigError("stands beside `runs`", key="diagnosis.minutes", allowed=allowed)
    found, faults = dict(settings.experiments), []
    for kind in kinds:
        own = settings.experiments.get(kind, Experiment())
        rows = [m for m in measurements if m.experiment == kind]
        try:
            found[kind] = _experiment(kind, own, config, factors, rows, path)
        except ConfigError as error:
            faults.append(error)
    raise_faults(faults)
    whole = settings.model_copy(update={"experiments": found})
    return _within_time(whole, config, measurements, kinds)


def _within_time(settings, config, measurements, kinds):
    """`Settings` with the number of runs that the time allows, of experiments that are described in
    full; as they are where the runs are given or none is needed."""
    if settings.runs is not None or alone(kinds):
        return settings
    rig = Rig(settings, config.own_run | {"experiment": config.experiment})
    found = seconds_of_kinds(rig, measurements)
    fewest = RUNS + MORE_RUNS * (len(found) - 1)
    if None in found.values():
        return settings.model_copy(update={"runs": fewest})
    each = float(np.mean(list(found.values())))  # type: ignore[arg-type]  # as many runs of each
    runs = int(60.0 * CORES * (settings.minutes or MINUTES) / each)
    runs = min(runs, MOST_RUNS * len(found))
    return settings.model_copy(update={"runs": runs if settings.minutes else max(runs, fewest)})


def seconds_of_kinds(rig: Rig, measurements: Sequence[Measurement]) -> dict[str, float | None]:
    """{experiment: mean time of one core [s] of a run at its measured settings, estimated}; None
    where nothing tells it."""
    found: dict[str, float | None] = {}
    for kind in dict.fromkeys(m.experiment for m in measurements):
        own = [rig.spec(m.condition, 0) for m in measurements if m.experiment == kind]
        try:
            found[kind] = _mean_seconds(own)
        except SpecError:  # its row is named by who checks all of them
            found[kind] = None
    return found


def _mean_seconds(specs):
    """Mean time of one core [s] of runs, estimated from their specs; None where nothing tells it of
    one, or without any."""
    seconds = [run_seconds(spec) for spec in specs]
    return float(np.mean(seconds)) if seconds and None not in seconds else None


WRITTEN = "settings.yaml"
"""File beside the plan that holds the settings in full."""


def as_file(settings: Settings, config: Config) -> str:
    """Text of a YAML file with all of `Settings` as a configuration has them. It can be edited and
    laid over the study's."""
    head = (
        "# How the diagnosis simulates each measured experiment: what the configuration gave, and\n"
        "# what followed from the study's tests, factors and measurements. To change it, edit a\n"
        "# copy and lay it over the study: --configfile config.yaml COPY.yaml\n"
    )
    data = settings.model_dump(mode="json", exclude_none=True, exclude={"catalogue", "minutes"})
    tests = {
        config.of_experiment(kind) or kind: {"experiment": kind, "diagnosis": own}
        for kind, own in data.pop("experiments").items()
    }
    whole = {"diagnosis": data, "tests": tests}
    return head + yaml.safe_dump(whole, sort_keys=False, allow_unicode=True)


def announced(settings: Settings, planned: Mapping[str, dict], file: str | Path) -> str:
    """A sentence on the runs that a diagnosis will make, before the first of them; planned: {run
    id: spec} of those that train the emulators."""
    each = _mean_seconds(planned.values())
    took = duration(settings.runs * each / CORES) if each else None
    facts = {"took": took, "cores": CORES, "runs": settings.runs, "training": len(planned)}
    return told("announced.j2", file=file, **facts)


def _experiment(kind, own, config, factors, rows, path):
    """`Experiment` with what was not given in it derived."""
    where = {"path": path, "line": rows[0].line, "column": "experiment", "value": kind}
    parameters = own.parameters or _parameters(kind, factors, where)
    run = own.run if own.run is not None else {}
    if own.parameters is None:
        # factors that are not calibrated, at the study's fixed levels
        fixed = {f.key: config.fixed[f.name] for f in factors if f.name in config.fixed}
        fixed = {key: level for key, level in fixed.items() if key not in parameters}
        run = overlay(with_levels({}, fixed), run)
    if None in (own.metric, own.parameters, own.levers, own.run):
        run = overlay(_rig(kind, config, own.run is not None, where), run)
    levers, held, levels = own.levers, dict(own.held), own.levels
    if levers is None:
        levers, more, few = _levers(kind, run, rows, path)
        held, levels = more | held, few | levels
    else:
        for name, (low, high) in levers.items():
            seen = [m.levers[name] for m in rows if name in m.levers]
            levers = levers | {name: [min([low, *seen]), max([high, *seen])]}
    # a table without any outcome may hold flows of what arched later
    ends = any(m.name == ENDED for m in experiments()[kind].metrics)
    ended = ENDED if ends and any(m.outcome for m in rows) else None
    changes = {
        "metric": own.metric or measurable(kind)[QUANTITIES[kind].name].key,
        "ended_by": own.ended_by or ended,
        "parameters": parameters,
        "levers": levers,
        "held": held,
        "levels": levels,
        "run": run,
    }
    return own.model_copy(update=changes)


def _parameters(kind, factors, where):
    """Keys of the factors that are calibrated on an experiment."""
    known = {f.key for f in factors}
    single = GIVEN["single"].get(kind)
    asked = [single["parameter"]] if single else GIVEN["coefficients"]
    found = [key for key in asked if key in known][:MOST]
    if not found:
        reason = "has no coefficient to calibrate: no row of the table of factors sets one of it"
        raise ConfigError(reason, **where, allowed=f"a factor with a key of {', '.join(asked)}")
    return found


def _rig(kind, config, given, where):
    """Grains, rig and numerics of an experiment as the study has them."""
    name = config.own if kind == config.experiment else config.of_experiment(kind)
    if name:
        own = config.run_of(name).items()
        return {k: v for k, v in own if k in RIG}
    if kind in GIVEN["single"]:
        size = config.own_run.get("particles", {}).get("diameter_mm")
        grain = {} if size is None else {"particles": {"diameter_mm": size}}
        return overlay(GIVEN["single"][kind]["run"], grain)
    if given:
        return {}
    reason = "has no rig to simulate it in: the study describes none"
    raise ConfigError(
        reason,
        **where,
        allowed=f"a test in `tests` with experiment: {kind} and its run: {{particles: ..., "
        "geometry: ...}",
    )


def _levers(kind, run, rows, path):
    """({lever: [least, largest]} of the levers that differ between the rows, {lever: value} of
    those that do not, {lever: its levels} of the levers that have few).

    At few levels a rig is asked where it was measured, and what it does from one level to the next
    is no error."""
    levers, held, levels = {}, {}, {}
    for name, lever in levers_of(kind).items():
        if lever.place is None or not any(name in m.levers for m in rows):
            continue
        default = of_run(run, name)
        empty = [m for m in rows if name not in m.levers]
        if empty and default is None:
            where = {"path": path, "line": empty[0].line, "column": name}
            reason = f"is empty, and the run spec has no {'.'.join(lever.place)}"
            raise ConfigError(reason, **where, allowed=f"the {lever.words} of this row")
        values = [m.levers.get(name, default) for m in rows]
        few = sorted(set(map(float, values)))
        if not few[1:]:
            held[name] = values[0]
            continue
        levers[name] = [min(values), max(values)]
        levels |= {name: few} if len(few) <= MOST_LEVELS else {}
    return levers, held, levels


class Setup:
    """A study's diagnosis before anything has been found: its table of measurements, checked, and
    how their conditions are simulated.

    study: a `calibration.chain.study.Study`, of which configuration and factors are used; settings:
    `diagnosis.settings.Settings`, which are completed. Raises ConfigError for conditions that no
    emulator covers or that cannot be run.

    measurements: what is calibrated on; tested: the same and the tests that ended without a value;
    kinds: the experiments among the measurements; of_contacts: whether single contacts are
    integrated, and nothing is emulated; factors: all of the study; rig: with those of them that are
    calibrated on the measurements; catalogue: {name: Mechanism}.
    """

    def __init__(self, study: Study, settings: Settings) -> None:
        config, path = study.config, study.config.measurements
        self.config, self.table, self.factors = config, read_all(path), read_factors(config.factors)
        self.measurements, outcomes = self.table.fitted, self.table.outcomes
        self.tested = self.measurements + outcomes
        self.kinds = list(dict.fromkeys(m.experiment for m in self.measurements))
        self.of_contacts = alone(self.kinds)
        rows = self.measurements + self.table.held_out
        self.settings = completed(settings, config, self.factors, rows + outcomes, path)
        if not self.of_contacts:
            check_levers(self.settings, rows, path)
        rig = Rig(self.settings, config.own_run | {"experiment": config.experiment})
        rig.check(rows)
        known = parameters_of(self.settings, config.factors, self.kinds)
        self.rig = replace(rig, factors=tuple(known))
        self.catalogue = catalogue_of(self.settings, self.kinds)

    def emulated(
        self, designs: Sequence[str | Path], plans: Sequence[str | Path]
    ) -> tuple[Emulated, list[dict[str, Any]]]:
        """`Emulated` of emulators that the finished runs of all designs so far train, those of free
        laws along a lever beside them, and a table of their errors."""
        rows = [row for file in designs for row in read_json(file)]
        specs = {name: spec for file in plans for name, spec in read_json(file).items()}
        settings, factors = self.settings, self.rig.factors
        metrics = as_tests(settings, specs, simulate(specs))
        laws = lever_laws(settings, factors, self.measurements)
        emulators, errors = train(rows, metrics, self.rig, self.catalogue)
        faults = untested(name for name, found in metrics.items() if found is None)
        failures = train_failures(rows, metrics, self.catalogue, faults)
        emulators = with_laws(emulators, settings, factors, laws)
        failures = with_laws(failures, settings, factors, laws)
        return Emulated(emulators, settings, factors, self.catalogue | laws, failures), errors
