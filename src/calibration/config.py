"""The configuration of a calibration: its schema, defaults and checks."""

from pathlib import Path
from typing import Annotated, Literal

import pandas as pd
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from calibration.errors import CalibrationError, ConfigError
from calibration.factors import read_factors
from calibration.goals import GOALS, RULES, Goal
from dem.errors import SpecError
from dem.io.mapping import read_mapping
from dem.spec import parse_spec

Positive = Annotated[float, Field(gt=0)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


METRICS = {
    "heap": (
        "angle_of_repose_deg",
        "radial_angle_deg",
        "height_mm",
        "on_plate",
        "spilled",
        "in_funnel",
        "rest_time_s",
    ),
    "drop": ("rebound_height_mm", "effective_restitution"),
    "tilt": ("sliding_angle_deg",),
    "shear": ("shear_stress_kPa", "steady_shear_stress_kPa", "bulk_density_kg_m3"),
}
"""What a run of each experiment can be calibrated to; the unit is in the name."""


class Target(_Part):
    """What the model is calibrated to."""

    file: str | None = Field(
        "config/measured_angles.csv", description="table of measured values, with a header"
    )
    column: str = Field("angle_deg", description="column of the table")
    metric: str = Field(
        "angle_of_repose_deg", description="metric of a run that is compared with it"
    )
    low: float | None = Field(
        None, description="value at which the desirability is 0; needed where there are several"
    )
    high: float | None = Field(
        None, description="value at which the desirability is 0; needed where there are several"
    )
    weight: Positive = Field(
        1.0,
        description="exponent of the desirability: above 1 asks for more than the way half there",
    )
    importance: Positive = Field(1.0, description="weight in the overall desirability")


class FurtherTarget(Target):
    """A second or third response that counts beside the target."""

    file: str | None = Field(
        None, description="table of measured values, for the goal `target` and the validation"
    )
    column: str = Field("value", description="column of the table")
    metric: str = Field(description="metric of a run")
    goal: Literal[GOALS] = Field(
        "target",
        description="meet the mean of the measured values, or go to one end of low to high",
    )
    low: float = Field(description="desirability 0 here, or 1 with the goal `minimise`")
    high: float = Field(description="desirability 0 here, or 1 with the goal `maximise`")
    margin: Positive | None = Field(
        None, description="difference that does not matter; needed with a file"
    )


class ScreeningConfig(_Part):
    """Plackett-Burman screening."""

    alpha: float = Field(0.05, gt=0, lt=1, description="factors with p below this are significant")
    replicates: int = Field(1, ge=1, le=20, description="how often the whole design is run")
    runs: int | None = Field(
        None, description="runs of the design; twelve, or as many as the factors need"
    )
    design: str | None = Field(
        None, description="table of coded levels in place of a generated design"
    )
    go_on: list[str] | None = Field(
        None,
        description="names of factors that go on whatever the screening says, to follow another's choice",
    )
    at_least: int = Field(
        3,
        ge=1,
        description="fewest factors that go on; filled up from the configured path, then by size",
    )
    at_most: int = Field(3, ge=1, le=7, description="most factors that go on")


class AscentConfig(_Part):
    """Steepest ascent."""

    steps: int = Field(5, ge=2, le=50, description="points on the path")
    rule: Literal["configured", "effects"] = Field(
        "configured",
        description="path from start and step where given for all factors that went on, else from effects",
    )
    start: dict[str, float] = Field({}, description="factor name: natural level of the first point")
    step: dict[str, float] = Field({}, description="factor name: natural step")


class SurfaceConfig(_Part):
    """Box-Behnken response surface around the ascent's best point."""

    centre: dict[str, float] = Field(
        {}, description="factor name: natural level of the centre in place of the ascent's"
    )
    half_width: dict[str, Positive] = Field(
        {}, description="factor name: natural distance from the centre to +1"
    )
    centre_runs: int = Field(5, ge=2, le=20, description="replicates of the centre")
    replicates: int = Field(1, ge=1, le=20, description="how often the whole design is run")


class OptimiseConfig(_Part):
    """Choice of a point among those that meet the target."""

    rule: Literal[RULES] = Field(
        "closest_to_centre", description="which point of the solution set is chosen"
    )
    candidate_runs: int = Field(
        10,
        ge=2,
        le=100,
        description="runs at the surface's optimum that are added before it is solved again",
    )
    point: dict[str, float] = Field(
        {},
        description="factor name: natural level, for the rule closest_to_point; the region's centre where not named",
    )


class ValidationConfig(_Part):
    """Replicate runs at the optimum."""

    groups: int = Field(5, ge=1, le=50, description="groups of replicates")
    replicates: int = Field(5, ge=1, le=50, description="replicates in a group")
    margin: float = Field(
        1.0, gt=0, description="difference that does not matter, in the target's unit"
    )
    alpha: float = Field(0.05, gt=0, lt=1, description="level of the tests")


class SweepConfig(_Part):
    """A bench test that calibrates one factor by a sweep."""

    measured: float = Field(gt=0, description="measured value")
    levels: list[Positive] = Field(min_length=4, description="levels of the factor")
    confirmations: int = Field(5, ge=1, le=50, description="runs at the inverse")
    run: dict = Field({}, description="grains, geometry and numerics of the test")


class ShearConfig(_Part):
    """Direct shear."""

    normal_stresses_kPa: list[Positive] = Field(
        [1.0, 2.0, 4.0], min_length=3, description="test loads"
    )
    levels: list[Positive] = Field(
        [0.2, 0.4, 0.6, 0.85], min_length=3, description="particle frictions"
    )
    replicates: int = Field(3, ge=1, le=50, description="runs at each load and friction")
    fixed: dict[str, float] = Field(
        {}, description="factor name: its level in the shear cell, in place of the study's"
    )
    measured_slope: float = Field(
        0.845, gt=0, description="slope of the measured yield locus (Eq. 26)"
    )
    measured_intercept_kPa: float = Field(0.084, ge=0, description="its intercept (Eq. 26)")
    run: dict = Field({}, description="grains, geometry and numerics of the test")


class BenchConfig(_Part):
    """The bench tests of 2.3.2 to 2.3.4."""

    tilt: SweepConfig = SweepConfig(measured=35.82, levels=[0.35, 0.45, 0.55, 0.65, 0.75, 0.85])
    drop: SweepConfig = SweepConfig(
        measured=20.5, levels=[0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75]
    )
    shear: ShearConfig = ShearConfig()


class ScalingConfig(_Part):
    """The scaling claim of 1.2, tried on the heap and the drop."""

    factors: list[Positive] = Field(
        [1.0, 2.0, 4.0], min_length=2, description="length factors; the first is compared with"
    )
    seeds: int = Field(6, ge=2, le=100, description="heaps at each scale")
    drop_seeds: int = Field(2, ge=2, le=100, description="runs of the drop at each scale")
    margin_deg: Positive = Field(2.0, description="change of the angle that does not matter")
    margin_restitution: Positive = Field(
        0.02, description="change of the restitution that does not matter"
    )
    point: dict[str, float] = Field({}, description="factor name: level in all these runs")
    cohesion: dict = Field(
        {
            "laws": {"cohesion": "jkr"},
            "law_parameters": {"surface_energy_J_m2": 0.04, "wall_surface_energy_J_m2": 0.04},
        },
        description="what the cohesive runs have at the first scale beyond the others",
    )
    heap: dict = Field({}, description="grains, rig and numerics of the heap at scale 1")
    drop: dict = Field({}, description="grains, rig and numerics of the drop at scale 1")


class ReproductionConfig(_Part):
    """The table that sets this project's values beside the paper's."""

    beside: list[str] = Field(
        [],
        description="names of further studies; one of the paper's own factors is compared point by point",
    )


class Config(_Part):
    """The whole configuration; `run` is the run spec that all heaps share."""

    name: str = Field("salt", pattern=r"^[A-Za-z0-9_-]+$", description="folder under results/")
    seed: int = Field(1, ge=0, lt=2**31, description="first seed; replicates count on from it")
    factors: str = Field("config/factors.tsv", description="table of factors")
    experiment: Literal["heap", "drop", "tilt", "shear"] = Field(
        "heap", description="virtual experiment whose metrics are calibrated"
    )
    target: Target = Target()
    further_targets: list[FurtherTarget] = Field(
        [], description="further responses; the optimum is then the most desirable point"
    )
    supplements: list[Literal["audit", "tilt", "drop", "shear", "scaling", "reproduction"]] = Field(
        [],
        description="what the report waits for beside the chain: bench tests, and the audit of the salt's paper",
    )
    measurements: str = Field(
        "config/measurements.csv", description="measured conditions for the diagnosis"
    )
    fixed: dict[str, float] = Field({}, description="factor name: level while it is not varied")
    fixed_from: Literal["config", "bench"] = Field(
        "config", description="bench: what tilt, drop and shear found replaces the levels in fixed"
    )
    run: dict = Field({}, description="run spec without experiment and seed")
    screening: ScreeningConfig = ScreeningConfig()
    ascent: AscentConfig = AscentConfig()
    response_surface: SurfaceConfig = SurfaceConfig()
    optimise: OptimiseConfig = OptimiseConfig()
    bench: BenchConfig = BenchConfig()
    scaling: ScalingConfig = ScalingConfig()
    reproduction: ReproductionConfig = ReproductionConfig()
    validation: ValidationConfig = ValidationConfig()
    diagnosis: dict = Field(
        {}, description="laid over config/diagnosis.yaml key by key; null takes a key away"
    )


def parse_config(data, file="configuration", files=()):
    """`Config` from a mapping that was merged from YAML `files`, later ones over earlier ones.

    Raises ConfigError naming file and line, key, value and what is allowed; `file` stands for the files where there are
    none.
    """
    try:
        return _parse(data, file)
    except ConfigError as error:
        if not error.key or str(error.path) != file:
            raise
        place = _place(error.key, error.value, files)
        if not place:
            raise
        path, line = place
        raise ConfigError(
            error.reason,
            path=path,
            line=line,
            key=error.key,
            value=error.value,
            allowed=error.allowed,
        ) from None


def _place(key, value, files):
    """(file, line) that sets a dotted key, or else of what lies nearest above it; None where no file does.

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
            for part in parts:
                data = data[part]
            own = len(parts) == len(key.split("."))
            if own and data != value and not isinstance(value, dict | list | None):
                best = ("--config", None)
    return best


def _parse(data, file):
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(p) for p in first["loc"])
        if first["type"] == "extra_forbidden":
            allowed = _known_keys(first["loc"])
        else:
            allowed = first["msg"].removeprefix("Input should be ")
        raise ConfigError(
            "is not valid", path=file, key=key, value=first.get("input"), allowed=allowed
        ) from None
    factors = read_factors(config.factors)
    names = [f.name for f in factors]
    for section, mapping in (
        ("fixed", config.fixed),
        ("bench.shear.fixed", config.bench.shear.fixed),
        ("scaling.point", config.scaling.point),
        ("screening.go_on", config.screening.go_on or ()),
        ("ascent.start", config.ascent.start),
        ("ascent.step", config.ascent.step),
        ("response_surface.centre", config.response_surface.centre),
        ("response_surface.half_width", config.response_surface.half_width),
        ("optimise.point", config.optimise.point),
    ):
        for name in mapping:
            if name not in names:
                raise ConfigError(
                    "is no factor", path=file, key=f"{section}.{name}", allowed=", ".join(names)
                )
    if (config.optimise.rule == "closest_to_point") != bool(config.optimise.point):
        raise ConfigError(
            "goes with the rule closest_to_point and only with it",
            path=file,
            key="optimise.point",
            value=config.optimise.point,
            allowed="a level for one factor or more, or no point with another rule",
        )
    _check_targets(config, file)
    _check_bench(config, file)
    _check_run(config, factors, file)
    return config


def _check_run(config, factors, file):
    """Refuse a run spec that no run could be made of, and factors that set no number of it or leave its ranges."""
    try:
        parse_spec(point_spec(config.run, config.experiment, {}, 1))
    except SpecError as error:
        raise ConfigError(
            "is not valid",
            path=file,
            key=f"run.{error.key}",
            value=error.value,
            allowed=error.allowed,
        ) from None
    for f in factors:
        for column in ("low", "high"):
            level = getattr(f, column)
            try:
                parse_spec(point_spec(config.run, config.experiment, {f.key: level}, 1))
            except SpecError as error:
                text = f"{f.name} cannot be {level:g}: {error}"
                raise ConfigError(text, path=config.factors, column=column) from None


def _check_targets(config, file):
    """Metrics exist and differ, measured values can be read, and goals make sense."""
    metrics = [t.metric for t in (config.target, *config.further_targets)]
    for n, metric in enumerate(metrics):
        key = "target.metric" if n == 0 else f"further_targets.{n - 1}.metric"
        if metric not in METRICS[config.experiment]:
            allowed = f"for the experiment {config.experiment}: " + ", ".join(
                METRICS[config.experiment]
            )
            raise ConfigError(
                "is no metric to calibrate to", path=file, key=key, value=metric, allowed=allowed
            )
        if metric in metrics[:n]:
            raise ConfigError("stands twice", path=file, key=key, value=metric)
    if config.target.file is None:
        raise ConfigError("must be given", path=file, key="target.file", allowed="a table")
    read_target(config)
    for n, target in enumerate(config.further_targets):
        key = f"further_targets.{n}"
        if target.file is None and target.goal == "target":
            raise ConfigError(
                "must be given", path=file, key=f"{key}.file", allowed="a table of measured values"
            )
        if target.file is not None and target.margin is None:
            raise ConfigError(
                "must be given with a file",
                path=file,
                key=f"{key}.margin",
                allowed="a difference that does not matter, in the metric's unit",
            )
    if config.further_targets:
        goals(config, file)


def goals(config, file="config"):
    """`Goal`s of the target and the further targets, in this order. Raises ConfigError."""
    found = []
    for n, target in enumerate((config.target, *config.further_targets)):
        key = "target" if n == 0 else f"further_targets.{n - 1}"
        if target.low is None or target.high is None:
            raise ConfigError(
                "must be given where there are several targets",
                path=file,
                key=f"{key}.low" if target.low is None else f"{key}.high",
                allowed="the value at which the desirability falls to 0",
            )
        kind = "target" if n == 0 else target.goal
        wanted = float(read_target(config, target).mean()) if kind == "target" else None
        try:
            found.append(
                Goal(kind, target.low, target.high, wanted, target.weight, target.importance)
            )
        except CalibrationError as error:
            raise ConfigError(str(error), path=file, key=key) from None
    return found


def stands_alone(path):
    """Whether a configuration file is a study of its own: one that names its factors is not laid over config.yaml."""
    try:
        data = yaml.safe_load(Path(path).read_text())
    except (OSError, yaml.YAMLError):
        return False  # whoever reads the file next says what is wrong with it
    return isinstance(data, dict) and "factors" in data


def _known_keys(loc):
    model = Config
    for part in loc[:-1]:
        model = FurtherTarget if isinstance(part, int) else model.model_fields[part].annotation
    return "one of the keys " + ", ".join(model.model_fields)


def read_target(config, target=None):
    """(n,) measured values of `target`, of the main one unless given. Raises ConfigError."""
    target = target or config.target
    path = Path(target.file)
    try:
        table = pd.read_csv(path, comment="#")
    except OSError as error:
        raise ConfigError(f"cannot be read ({error.strerror})", path=path) from None
    if target.column not in table:
        raise ConfigError(
            "no such column",
            path=path,
            key="target.column" if target is config.target else f"column of {target.metric}",
            value=target.column,
            allowed=", ".join(table.columns),
        )
    values = pd.to_numeric(table[target.column], errors="coerce")
    if values.isna().any():
        line = int(values.isna().to_numpy().nonzero()[0][0]) + 2
        raise ConfigError("is not a number", path=path, line=line, column=target.column)
    if len(values) < 2:
        raise ConfigError("needs at least two values to have a spread", path=path)
    return values.to_numpy()


def point_spec(base, experiment, levels, seed):
    """Run spec as a mapping: `base` with the keys of `levels` {dotted key: value} set."""
    spec = _copy(base)
    spec["experiment"], spec["seed"] = experiment, int(seed)
    for key, value in levels.items():
        part = spec
        *path, last = key.split(".")
        for name in path:
            part = part.setdefault(name, {})
        part[last] = float(value)
    return spec


def bench_run(config, *changes):
    """Run spec of a bench test: the study's materials and laws with `changes` (the test's rig and grains) laid over."""
    run = {k: v for k, v in config.run.items() if k in ("materials", "laws", "law_parameters")}
    for change in changes:
        run = overlay(run, change)
    return run


def _check_bench(config, file):
    """Refuse a bench test's run spec that no run could be made of."""
    for test in ("tilt", "drop", "shear"):
        run = bench_run(config, getattr(config.bench, test).run)
        try:
            parse_spec(point_spec(run, test, {}, 1), file=file)
        except SpecError as error:
            raise ConfigError(str(error), path=file, key=f"bench.{test}.run") from None


def overlay(base, changes):
    """A copy of the nested mapping `base` with the keys of `changes` laid over it."""
    out = _copy(base)
    for key, value in changes.items():
        out[key] = overlay(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


def _copy(data):
    return {k: _copy(v) if isinstance(v, dict) else v for k, v in data.items()}
