"""From a configuration's files to a checked `Config`: an error names file and line, key, value and
what is allowed."""

import difflib
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import ValidationError

from calibration import engines
from calibration.errors import CONFIGURATION, ConfigError, at_key, first_fault
from calibration.intake.measurements import read_measured
from calibration.intake.tables import check_plausible, in_key_units
from calibration.study.config.joint import check_joint
from calibration.study.config.measured import NotComparableError, is_measured, read_target
from calibration.study.config.schema import COARSER, MEANINGS, Config
from calibration.study.config.specs import point_spec, states
from calibration.study.config.tests import check_tests, key_in
from calibration.study.factors import read_factors, section_of
from dem.errors import InputError, SpecError
from dem.experiments.mesh import check_meshes_of
from dem.io.mapping import read_mapping
from dem.spec import parse_spec


def parse_config(
    data: Any, files: Sequence[str | Path] = (), stages: Collection[str] | None = None
) -> Config:
    """`Config` from a mapping that was merged from YAML `files`, later ones over earlier ones.

    Raises ConfigError naming file and line, key, value and what is allowed. stages: names that
    `supplements` may have, any unless given.
    """
    if not isinstance(data, Mapping):
        path = files[-1] if files else CONFIGURATION
        raise ConfigError("is no mapping", path=path, allowed="a YAML mapping of keys")
    try:
        config = _parse(data)
        for n, name in enumerate(config.supplements):
            if stages is not None and name not in stages:
                raise at_key(f"supplements.{n}", "is no stage", name, ", ".join(stages))
        return config
    except ConfigError as error:
        if not error.key or error.path != CONFIGURATION:
            raise
        place = _place(error.key, error.value, files)
        if not (place or files):
            raise
        path, line = place or (files[-1], None)  # a key that none of them has
        raise ConfigError(**vars(error) | {"path": path, "line": line}) from None


def given(config: Config, key: str, stage: str) -> Any:
    """The value of a dotted key that `stage` cannot do without. Raises ConfigError naming both."""
    value = config
    for name in key.split("."):
        value = getattr(value, name)
    if value is None or value in ({}, []):
        raise ConfigError(f"must be given for the stage {stage}", key=key)
    return value


def stands_alone(path: str | Path) -> bool:
    """Return whether a configuration file is a study of its own: one that names its factors is not
    laid over config.yaml."""
    try:
        data, _ = read_mapping(path)
    except SpecError:
        return False  # whoever reads the file next says what is wrong with it
    return isinstance(data, dict) and "factors" in data


def _place(key, value, files):
    """(file, line) that sets a dotted key, or else of what lies nearest above it; None where no
    file does.

    A single value that is not the file's own was set on the command line.
    """
    best, depth = None, 0
    for path in files:
        try:
            data, lines = read_mapping(path)
        except SpecError:
            continue  # not a mapping of its own; what is wrong with it was told when it was merged
        parts = key.split(".")
        while parts and ".".join(parts) not in lines:
            parts.pop()
        if parts and len(parts) >= depth:
            best, depth = (path, lines[".".join(parts)]), len(parts)
            if len(parts) > 1 and key in data:  # one key of the file that has dots in it
                continue
            try:
                for part in parts:
                    data = data[part]
            except (KeyError, TypeError):  # such a key further down, or one that is no word
                continue
            own = len(parts) == len(key.split("."))
            same = data == value or (data != data and value != value)  # a NaN equals nothing
            if own and not same and not isinstance(value, dict | list | None):
                best = ("--config", None)
    return best


def _parse(data):
    for key, instead in MEANINGS["replaced"].items():
        if states(data, key):
            raise at_key(key, "is a key no more", allowed=instead)
    check_plausible(data)
    data = in_key_units(data)
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        found = first_fault(error)
        if first["type"] == "missing":
            found |= {"value": None, "allowed": _field(first["loc"]).description}
            raise at_key(**found, reason="must be given") from None
        if first["type"] == "extra_forbidden":
            known = list(_section(first["loc"]).model_fields)
            near = difflib.get_close_matches(str(first["loc"][-1]), known, n=1, cutoff=0.8)
            known = f"one of the keys {', '.join(known)}"
            found["allowed"] = f"{near[0]}, the nearest key" if near else known
        elif first["type"] == "string_pattern_mismatch":
            found["allowed"] = _field(first["loc"]).description
        raise at_key(**found, reason="is not valid") from None
    factors = read_factors(config.factors)
    names = [f.name for f in factors]
    for section, mapping in (
        ("fixed", config.fixed),
        *((f"tests.{name}.fixed", test.fixed) for name, test in config.tests.items()),
        ("scaling.point", config.scaling.point if config.scaling else ()),
        ("screening.go_on", config.screening.go_on or ()),
        ("ascent.start", config.ascent.start),
        ("ascent.step", config.ascent.step),
        ("response_surface.centre", config.response_surface.centre),
        ("response_surface.half_width", config.response_surface.half_width),
        ("joint.factors", config.joint.factors),
        ("posterior.priors", config.posterior.priors),
    ):
        for name in mapping:
            if name not in names:
                raise at_key(f"{section}.{name}", "is no factor", allowed=", ".join(names))
    _check_candidate(config)
    config = with_engine(config)
    check_tests(config)
    _check_run(config, factors)
    _check_measured(config)
    check_joint(config, factors)
    return config


def _check_candidate(config):
    """The first runs at the candidate tell their scatter, where it counts, and are no more than
    the most."""
    rules = config.optimise
    if rules.candidate_half_width and not 2 <= rules.candidate_runs <= rules.candidate_at_most:
        raise at_key(
            "optimise.candidate_runs",
            "cannot be the first runs, whose scatter tells how many there are",
            rules.candidate_runs, f"2 to {rules.candidate_at_most} (candidate_at_most)",
        )  # fmt: skip


def _section(loc):
    """The schema that holds the key at a place of pydantic's."""
    model, named = Config, None
    for part in loc[:-1]:
        if named:  # the name that stands before a section's keys
            model, named = named, None
        else:
            annotation = model.model_fields[part].annotation
            model = section_of(annotation) or model
            named = section_of(get_args(annotation)[1]) if get_origin(annotation) is dict else None
    return model


def _field(loc):
    return _section(loc).model_fields[loc[-1]]


def _check_measured(config):
    """Measured values can be read. A target that was not measured, or not at the setting that is
    simulated, is refused by the stages that use it: a study may have a table for its diagnosis
    alone."""
    for row in read_measured(config.measurements).conditions:
        named = config.tests.get(row.test)
        if row.test and (named is None or named.experiment != row.experiment):
            raise ConfigError(
                f"is no test of the experiment {row.experiment}", path=config.measurements,
                line=row.line, column="test", value=row.test,
                allowed=", ".join(
                    n for n, t in config.tests.items() if t.experiment == row.experiment
                ) or "empty",
            )  # fmt: skip
    if is_measured(config):
        with suppress(NotComparableError):
            read_target(config)


def with_engine(config: Config) -> Config:
    """The configuration with its engine, program and version, in the run spec that all runs
    share. Raises ConfigError."""
    try:
        entry = engines.entry_of(config.engine)
    except ConfigError as error:
        raise ConfigError(**vars(error) | {"path": CONFIGURATION}) from None
    if entry is None:
        if "engine" in config.run:
            raise at_key("run.engine", "is no key of a run; the study's own key engine names it")
        return config
    return config.model_copy(update={"run": config.run | {"engine": entry}})


def _check_run(config, factors):
    """Refuse a run spec that no run could be made of, and factors that set no number of it or leave
    its ranges."""
    try:
        spec = parse_spec(point_spec(config.own_run, config.experiment, {}, 1))
        engines.check(spec)
        check_meshes_of(spec)
    except engines.EngineError as error:
        raise at_key("engine", str(error)) from None
    except SpecError as error:
        key = key_in(config, config.own, error.key)
        raise at_key(key, "is not valid", error.value, error.allowed) from None
    except InputError as error:
        key = key_in(config, config.own, error.key)
        raise ConfigError(**vars(error) | {"key": key}) from None
    for f in factors:
        for column in ("low", "high"):
            value = getattr(f, column)
            try:
                parse_spec(point_spec(config.own_run, config.experiment, {f.key: value}, 1))
            except SpecError as error:
                text = f"{f.name} cannot be {value}: {error}"
                raise ConfigError(text, path=config.factors, column=column) from None


def parse_resolved(
    data: Mapping[str, Any], files: Sequence[str | Path] = (), stages: Collection[str] | None = None
) -> Config:
    """`parse_config`. Raises ConfigError of the resolution where the files make a study without it,
    and as `parse_config` does elsewhere."""
    asked = str(data.get("resolution"))
    try:
        return parse_config(data, files, stages)
    except ConfigError as error:
        if asked not in COARSER:
            raise
        parse_config({**data, "resolution": "full"}, files, stages)  # its own fault comes first
        told = str(error)
        if error.key:  # what stands behind file and line
            value = f" {error.value}" if error.value is not None else ""
            needed = f", where it has to be {error.allowed}" if error.allowed else ""
            told = f"{str(error.key).removeprefix('run.')}{value}{needed}"
        raise ConfigError(
            f"its grains are {COARSER[asked] ** (1 / 3):.3g} times as wide as the study's, and do "
            f"not fit: {told}", key="resolution", value=asked,
            allowed="a finer one, or none: without --config resolution they are the study's",
        ) from None  # fmt: skip
