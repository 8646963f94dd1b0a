"""The schema of a study's configuration: every key with its unit, range, default and meaning."""

from types import UnionType
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, model_validator

from calibration.statistics.goals import GOALS, RULES
from dem.experiments import experiments
from dem.units import converted

Positive = Annotated[float, Field(gt=0)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


COARSER = {"quick": 4.0, "test": 8.0}
"""Resolution -> how many times fewer grains."""


def coarsened(data: dict[str, Any]) -> dict[str, Any]:
    """A configuration whose `resolution` is carried out: fewer, larger grains, and a name that says
    so."""
    resolution, run = data.get("resolution"), data.get("run")
    factor = COARSER.get(resolution) if isinstance(resolution, str) else None
    particles = run.get("particles") if isinstance(run, dict) else None
    if factor is None or not isinstance(particles, dict) or "count" not in particles:
        return data
    try:
        return _with_fewer(data, particles, factor)
    except (TypeError, ValueError, ArithmeticError):  # the schema says what is no number
        return data


def _with_fewer(data, particles, factor):
    grown = factor ** (1 / 3)
    if particles.get("diameter_mm") is not None:
        larger = {"diameter_mm": round(grown * particles["diameter_mm"], 4)}
    else:
        larger = {"scale_factor": round(grown * particles.get("scale_factor", 1.0), 6)}
    particles = particles | larger | {"count": max(round(particles["count"] / factor), 1)}
    geometry = dict(data["run"].get("geometry") or {})
    if "generation_rate_per_s" in geometry:
        geometry["generation_rate_per_s"] /= factor
    run = data["run"] | {"particles": particles} | ({"geometry": geometry} if geometry else {})
    name = f"{data.get('name')}-{data['resolution']}"
    return data | {"run": run, "name": name, "resolution": "full"}


def section_of(annotation: Any) -> type[BaseModel] | None:
    """The schema of a nested section, also where it may be left out; None for any other key."""
    parts = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    found = (p for p in parts if isinstance(p, type) and issubclass(p, BaseModel))
    return next(found, None)


def named_section_of(annotation: Any) -> type[BaseModel] | None:
    """The schema of the sections in a mapping of names; None for any other key."""
    parts = get_args(annotation)
    return section_of(parts[1]) if get_origin(annotation) is dict else None


METRICS = {name: e.targets for name, e in experiments().items()}
"""What a run of each experiment can be calibrated to; the unit is in the name."""


class Target(_Part):
    """What the model is calibrated to."""

    metric: str = Field(
        "angle_of_repose_deg",
        description="metric of a run that is compared with the measured values of its name",
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

    metric: str = Field(description="metric of a run")
    goal: Literal[GOALS] = Field(  # type: ignore[valid-type]
        "target",
        description="meet the mean of the measured values, or go to one end of low to high",
    )
    low: float = Field(description="desirability 0 here, or 1 with the goal `minimise`")
    high: float = Field(description="desirability 0 here, or 1 with the goal `maximise`")
    margin: Positive | None = Field(
        None, description="difference that does not matter; needed where it was measured"
    )


class ScreeningConfig(_Part):
    """Screening of all factors."""

    alpha: float = Field(0.05, gt=0, lt=1, description="factors with p below this are significant")
    replicates: int = Field(1, ge=1, le=20, description="how often the whole design is run")
    kind: Literal["resolution_iv", "definitive", "plackett_burman"] = Field(
        "resolution_iv",
        description="design: two levels of resolution IV, three levels (definitive), or "
        "Plackett-Burman's fewer "
        "runs, whose main effects are mixed with two-factor interactions",
    )
    centre_runs: int = Field(
        3,
        ge=0,
        le=20,
        description="runs at the centre of a generated design, whose scatter the effects are "
        "judged against; none "
        "in a Plackett-Burman design",
    )
    foldover: bool = Field(
        False,
        description="also run the design with all signs changed, which parts main effects from "
        "interactions",
    )
    runs: int | None = Field(
        None,
        ge=4,
        description="runs of a Plackett-Burman design; twelve, or as many as the factors need",
    )
    design: str | None = Field(
        None, description="table of coded levels in place of a generated design"
    )
    go_on: list[str] | None = Field(
        None,
        description="names of factors that go on whatever the screening says, to follow another's "
        "choice",
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
        description="path from start and step where given for all factors that went on, else from "
        "the effects on "
        "the first target",
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
    added_runs: int = Field(
        0,
        ge=0,
        le=200,
        description="runs beside the design, at the points that tell most about the model "
        "(D-optimal)",
    )


class OptimiseConfig(_Part):
    """Choice of a point among those that meet the target."""

    rule: Literal[RULES] = Field(  # type: ignore[valid-type]
        "closest_to_centre", description="which point of the solution set is chosen"
    )
    candidate_runs: int = Field(
        10,
        ge=2,
        le=100,
        description="runs at the surface's optimum that are added before it is solved again; with "
        "`candidate_half_width` the first of them",
    )
    candidate_half_width: Positive | None = Field(
        None,
        description="half of the 95 % interval of these runs' mean, in the target's unit: as many "
        "runs are added as the first ones' scatter asks for (Stein's rule); without it no more",
    )
    candidate_at_most: int = Field(
        100,
        ge=2,
        le=1000,
        description="most of these runs, however wide their interval is then",
    )
    point: dict[str, float] = Field(
        {},
        description="factor name: natural level, for the rule closest_to_point; the region's "
        "centre where not named",
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

    levels: list[Positive] = Field(min_length=4, description="levels of the factor")
    confirmations: int = Field(5, ge=1, le=50, description="runs at the inverse")
    run: dict = Field({}, description="grains, geometry and numerics of the test")


class ShearConfig(_Part):
    """Direct shear."""

    normal_stresses_kPa: list[Positive] = Field(min_length=3, description="test loads")
    levels: list[Positive] = Field(min_length=3, description="particle frictions")
    replicates: int = Field(3, ge=1, le=50, description="runs at each load and friction")
    fixed: dict[str, float] = Field(
        {}, description="factor name: its level in the shear cell, in place of the study's"
    )
    run: dict = Field({}, description="grains, geometry and numerics of the test")


class BenchConfig(_Part):
    """Tests on the laboratory's bench; each stage needs the section of its name."""

    tilt: SweepConfig | None = Field(None, description="tilted plane: friction on the wall")
    drop: SweepConfig | None = Field(None, description="drop: restitution on the wall")
    shear: ShearConfig | None = Field(None, description="direct shear: friction between grains")


class ScalingConfig(_Part):
    """Heap and drop enlarged by two rules: which of them keeps the responses."""

    factors: list[Positive] = Field(
        [1.0, 2.0, 4.0], min_length=2, description="length factors; the first is compared with"
    )
    seeds: int = Field(6, ge=2, le=100, description="heaps at each scale")
    end_seeds: int | None = Field(
        None,
        ge=2,
        le=100,
        description="heaps at the first and the last scale, which carry the trend; `seeds` unless "
        "given",
    )
    cohesive_end_seeds: int | None = Field(
        None, ge=2, le=100, description="the same with cohesion; `end_seeds` unless given"
    )
    drop_seeds: int = Field(2, ge=2, le=100, description="runs of the drop at each scale")
    margin_deg: Positive = Field(2.0, description="change of the angle that does not matter")
    margin_restitution: Positive = Field(
        0.02, description="change of the restitution that does not matter"
    )
    point: dict[str, float] = Field({}, description="factor name: level in all these runs")
    cohesion: dict = Field(
        description="law and constants that the cohesive runs have at the first scale"
    )
    heap: dict = Field({}, description="grains, rig and numerics of the heap at scale 1")
    drop: dict = Field({}, description="grains, rig and numerics of the drop at scale 1")


class PriorConfig(_Part):
    """What was known of a factor before: a normal distribution, cut to the region."""

    mean: float = Field(description="natural level")
    sd: Positive = Field(description="standard deviation, in the factor's unit")


class PosteriorConfig(_Part):
    """The parameters as a distribution."""

    draws: int = Field(500, ge=50, le=10000, description="draws that are kept in the table")
    priors: dict[str, PriorConfig] = Field(
        {}, description="factor name: what is known of it; uniform over the region where not named"
    )
    discrepancy: dict[str, float] = Field(
        {},
        description="metric: standard deviation by which the model itself may be wrong, in the "
        "metric's unit; "
        "none unless given",
    )
    readings: int = Field(
        5,
        ge=1,
        description="readings that the next experiment would take, for its expected information",
    )


class PourRateConfig(_Part):
    """Heaps at the optimum, poured at other rates."""

    rates_per_s: list[Positive] = Field(
        min_length=2, description="grains that are made in a second, one rate after the other"
    )
    heaps: int = Field(6, ge=2, le=100, description="heaps at each rate")
    opened: dict | None = Field(
        None,
        description="geometry of a funnel that is filled and then opened, beside these rates; "
        "without it no such heap",
    )


class _Simulated(_Part):
    """A test or a machine and the run spec that stands for it."""

    experiment: Literal[tuple(METRICS)] = Field(description="virtual experiment that stands for it")  # type: ignore[valid-type]
    run: dict = Field(
        {},
        description="grains, geometry and numerics, laid over the study's run where it is of the "
        "same experiment, else over its materials and laws",
    )


class PushConfig(_Simulated):
    """A machine that is simulated with draws of the posterior."""

    metrics: list[str] = Field(
        [], description="metrics that are reported; all of the experiment unless given"
    )
    draws: int = Field(20, ge=3, le=300, description="draws of the posterior")
    replicates: int = Field(
        2, ge=1, le=20, description="runs with each draw; two tell the seeds' scatter apart"
    )


class RigConfig(_Simulated):
    """A test of the laboratory, or a machine, as it is simulated."""

    metrics: list[str] = Field(
        [],
        description="metrics that could be measured next and are predicted; the experiment's "
        "main one and those of `targets` unless given",
    )
    fixed: dict[str, float] = Field(
        {},
        description="factor name: its level in this rig, whatever it is in the others, as of side "
        "walls that are smooth",
    )


class JointTarget(_Part):
    """A measured metric of a rig, or coefficients of a measured curve that are metrics of it."""

    rig: str | list[str] = Field(
        description="name in `rigs`; for a curve over a setting a list of them, one a setting"
    )
    metric: str | None = Field(None, description="metric, compared with the rows of its name")
    curve: str | None = Field(
        None, description="CSV table of measured curves, in place of `metric`: curve, x, y"
    )
    shape: str | None = Field(
        None, description="what is read of these curves; goes with `curve` and only with it"
    )
    error: Positive | None = Field(
        None,
        description="standard error of the measured mean, in the metric's unit, where the table "
        "holds a single reading without one",
    )
    discrepancy: float = Field(
        0.0,
        ge=0,
        description="standard deviation by which the model itself may be wrong, in the metric's "
        "unit",
    )

    @property
    def rigs(self) -> tuple[str, ...]:
        """Names of its rigs."""
        return (self.rig,) if isinstance(self.rig, str) else tuple(self.rig)


class JointPrior(PriorConfig):
    """What was known of a factor before the tests, and who says so."""

    source: str = Field(min_length=1, description="where it comes from")


class JointConfig(_Part):
    """One posterior over all `targets`."""

    factors: list[str] = Field(
        [], description="factors that are free; all whose levels are numbers unless given"
    )
    runs: int = Field(60, ge=8, le=900, description="points of the common design of all rigs")
    repeated: int = Field(
        16, ge=0, le=500, description="of these, points that are run twice, which tells the scatter"
    )
    second_wave: int = Field(
        20, ge=0, le=500, description="points added where the first runs leave the posterior wide"
    )
    draws: int = Field(1000, ge=50, le=10000, description="draws that are kept in the table")
    priors: dict[str, JointPrior] = Field(
        {}, description="factor name: what is known of it; uniform over its levels where not named"
    )
    readings: int = Field(5, ge=2, description="readings that the next test would take")
    hours: dict[str, Positive] = Field(
        {},
        description="rig: hours in the laboratory for so many readings; assumed unless given",
    )
    machine: str | None = Field(
        None, description="rig whose metrics are to be predicted, in place of the parameters"
    )


class CalibrateConfig(_Part):
    """Which parameters the study hands out."""

    by: Literal["chain", "joint"] | None = Field(
        None,
        description="chain: those of the surface, to one target; joint: those of all `targets` "
        "together. Unless given joint where the report waits for the stage `joint`",
    )


class PublishedConfig(_Part):
    """Values printed elsewhere, which calibrated.yaml sets beside this study's."""

    tables: dict[str, str | None] = Field(
        {},
        description="CSV table (name or parameter, value, unit): where it is printed, "
        "for rows that do not say so in `where`",
    )
    names: dict[str, str] = Field(
        {}, description="key of the run spec: its name in the tables; factors have their own"
    )


class Config(_Part):
    """The whole configuration; `run` is the run spec that all heaps share."""

    @model_validator(mode="before")
    @classmethod
    def _in_key_units(cls, data):
        return coarsened(converted(data)) if isinstance(data, dict) else data

    name: str = Field(
        pattern=r"^[A-Za-z0-9_-]+$",
        description="folder of the study's results: letters, digits, _ and - alone",
    )
    results: str = Field(
        "results",
        pattern=r"^[^{}*?<>|\s]([^{}*?<>|]*[^{}*?<>|\s/])?$",
        description="folder of all studies' results, with the runs that they share: a path without "
        "{}*?<>| and without blanks at its ends",
    )
    seed: int = Field(1, ge=0, lt=2**31, description="first seed; replicates count on from it")
    factors: str = Field(description="table of factors")
    engine: str | dict = Field(
        "dem",
        description="what makes the runs: dem, liggghts, lammps, yade, or a mapping with name and "
        "settings of it, "
        "of command or of table",
    )
    experiment: Literal[tuple(METRICS)] = Field(  # type: ignore[valid-type]
        "heap", description="virtual experiment whose metrics are calibrated"
    )
    measurements: str = Field(
        description="table of all that was measured: experiment, quantity, value, unit, levers ..."
    )
    target: Target
    further_targets: list[FurtherTarget] = Field(
        [], description="further responses; the optimum is then the most desirable point"
    )
    supplements: list[str] = Field(
        [], description="stages that the report waits for beside the chain: tilt, drop, shear ..."
    )
    fixed: dict[str, float | str] = Field(
        {}, description="factor name: level while it is not varied, a word for a choice"
    )
    fixed_from: Literal["config", "bench"] = Field(
        "config", description="bench: what tilt, drop and shear found replaces the levels in fixed"
    )
    run: dict = Field({}, description="run spec without experiment and seed")
    resolution: Literal["full", *COARSER] = Field(  # type: ignore[valid-type]
        "full",
        description="quick and test pour fewer, larger grains of the same volume, under a name of "
        "their own",
    )
    runs_per_job: int | None = Field(
        None,
        ge=1,
        le=100_000,
        description="runs that one process makes after another; unless given, so many that "
        "starting it costs little beside them",
    )
    screening: ScreeningConfig = ScreeningConfig()
    ascent: AscentConfig = AscentConfig()
    response_surface: SurfaceConfig = SurfaceConfig()
    optimise: OptimiseConfig = OptimiseConfig()
    bench: BenchConfig = BenchConfig()
    scaling: ScalingConfig | None = Field(None, description="the stage `scaling` needs it")
    validation: ValidationConfig = ValidationConfig()
    posterior: PosteriorConfig = PosteriorConfig()
    pour_rate: PourRateConfig | None = Field(None, description="the stage `pour_rate` needs it")
    push_through: dict[str, PushConfig] = Field(
        {}, description="machine: how it is simulated with draws of the posterior"
    )
    rigs: dict[str, RigConfig] = Field(
        {}, description="name: a test of the laboratory or a machine, for the stage `joint`"
    )
    targets: list[JointTarget] = Field(
        [],
        description="measured metrics of any rig, to which the stage `joint` calibrates",
    )
    joint: JointConfig = JointConfig()
    calibrate: CalibrateConfig = CalibrateConfig()
    published: PublishedConfig = PublishedConfig()
    numerics: str | None = Field(
        None, description="YAML file of points and variants; the stage `numerics` needs it"
    )
    diagnosis: dict = Field(
        {},
        description="how each measured experiment is simulated for the diagnosis; `settings` names "
        "a YAML file, over which the other keys are laid; null takes a key away",
    )

    @property
    def runs(self) -> str:
        """Folder of the runs, which all studies of `results` share."""
        return f"{self.results}/runs"
