"""The schema of a study's configuration: every key with its unit, range, default and meaning."""

from types import UnionType
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, model_validator

from calibration.statistics.goals import RULES
from calibration.study.config.specs import overlay
from dem.experiments import experiments
from dem.units import converted

Positive = Annotated[float, Field(gt=0)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


INHERITED = ("experiment", "run", "fixed", "discrepancy")
"""Keys of a test that one that is `like` it has too."""

COARSER = {"quick": 4.0, "test": 8.0}
"""Resolution -> how many times fewer grains."""


def coarsened(data: dict[str, Any]) -> dict[str, Any]:
    """A configuration whose `resolution` is carried out: fewer, larger grains in the test that it
    calibrates on, and a name that says so."""
    factor = COARSER.get(str(data.get("resolution")))
    run = _own_run(data) if factor else {}
    if factor is None or "count" not in (run.get("particles") or {}):
        return data
    try:
        return _with_fewer(data, run, factor)
    except (TypeError, ValueError, ArithmeticError):  # the schema says what is no number
        return data


def _own_run(data):
    """Run spec of the test that a configuration (a mapping) calibrates on; empty where it is not
    well formed, which the schema says."""
    own = (data.get("tests") or {}).get(_own_name(data))
    parts = [data.get("run", {}), own.get("run", {}) if isinstance(own, dict) else None]
    return overlay(*parts) if all(isinstance(p, dict) for p in parts) else {}


def _own_name(data):
    """Name of the test that a configuration (a mapping) calibrates on."""
    return (data.get("calibrate") or {}).get("test") or next(iter(data.get("tests") or {}), None)


def _with_fewer(data, run, factor):
    grown, particles = factor ** (1 / 3), run["particles"]
    if particles.get("diameter_mm") is not None:
        larger = {"diameter_mm": round(grown * particles["diameter_mm"], 4)}
    else:
        larger = {"scale_factor": round(grown * particles.get("scale_factor", 1.0), 6)}
    changes = {"particles": larger | {"count": max(round(particles["count"] / factor), 1)}}
    rate = (run.get("geometry") or {}).get("generation_rate_per_s")
    if rate is not None:
        changes["geometry"] = {"generation_rate_per_s": rate / factor}
    tests = overlay(data["tests"], {_own_name(data): {"run": changes}})
    name = f"{data.get('name')}-{data['resolution']}"
    return data | {"tests": tests, "name": name, "resolution": "full"}


def alike(data: dict[str, Any]) -> dict[str, Any]:
    """A configuration in which each test that is `like` another has what that one states, below
    its own."""
    tests = data.get("tests")
    if not isinstance(tests, dict):
        return data
    return data | {"tests": {name: _as_the_other(tests, own) for name, own in tests.items()}}


def _as_the_other(tests, own):
    other = tests.get(own.get("like")) if isinstance(own, dict) else None
    if not isinstance(other, dict):
        return own
    return overlay({key: other[key] for key in INHERITED if key in other}, own)


def section_of(annotation: Any) -> type[BaseModel] | None:
    """The schema of a nested section, also where it may be left out; None for any other key."""
    parts = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    found = (p for p in parts if isinstance(p, type) and issubclass(p, BaseModel))
    return next(found, None)


def named_section_of(annotation: Any) -> type[BaseModel] | None:
    """The schema of the sections in a mapping of names; None for any other key."""
    parts = get_args(annotation)
    return section_of(parts[1]) if get_origin(annotation) is dict else None


VIEWS = ("own", "experiment", "own_run", "target", "further_targets", "by_atlas")
"""What follows from a `Config`'s sections and what a stage may read in their place."""

METRICS = {name: e.targets for name, e in experiments().items()}
"""What a run of each experiment can be calibrated to; the unit is in the name."""


class Response(_Part):
    """What is asked of a metric of the test that the chain calibrates on."""

    low: float | None = Field(
        None, description="desirability 0 here; needed where there are several metrics"
    )
    high: float | None = Field(
        None, description="desirability 0 here; needed where there are several metrics"
    )
    margin: Positive | None = Field(
        None,
        description="difference that does not matter, of a further metric; of the first one "
        "`validation` has it",
    )


class Target(Response):
    """A metric to which the chain calibrates, and what is asked of it."""

    metric: str


class ScreeningConfig(_Part):
    """Screening of all factors."""

    alpha: float = Field(0.05, gt=0, lt=1, description="factors with p below this are significant")
    replicates: int = Field(1, ge=1, le=20, description="how often the whole design is run")
    kind: Literal["resolution_iv", "plackett_burman"] = Field(
        "resolution_iv",
        description="design: two levels of resolution IV, or Plackett-Burman's fewer runs, whose "
        "main effects are mixed with two-factor interactions",
    )
    centre_runs: int = Field(
        3,
        ge=0,
        le=20,
        description="runs at the centre of a generated design, whose scatter the effects are "
        "judged against; none in a Plackett-Burman design",
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
        "the effects on the first target",
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

    rule: Literal[RULES] = Field(  # type: ignore[valid-type]
        "closest_to_centre", description="which point of the solution set is chosen"
    )
    candidate_runs: int = Field(
        10,
        ge=0,
        le=100,
        description="runs at the surface's optimum that are added before it is solved again; with "
        "`candidate_half_width` the first of them, two or more; with 0 the optimum of the surface "
        "goes to the validation as it is",
    )
    candidate_half_width: Positive | None = Field(
        None,
        description="half of the 95 % interval of these runs' mean, in the target's unit: as many "
        "runs are added as the first ones' scatter asks for (Stein's rule); without it no more",
    )
    candidate_at_most: int = Field(
        100, ge=2, le=1000, description="most of these runs, however wide their interval is then"
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
    """One factor swept over a test; the level that gives the measured value is read off."""

    levels: list[Positive] = Field(min_length=3, description="levels of the factor")
    confirmations: int = Field(5, ge=1, le=50, description="runs at the inverse; none of a shear")
    normal_stresses_kPa: list[Positive] = Field(
        [], description="loads of a shear test, three or more; of no other test"
    )
    replicates: int = Field(
        3, ge=1, le=50, description="runs at each load and friction of a shear test"
    )


class CurvesConfig(_Part):
    """Measured curves, of which coefficients are compared in place of a metric."""

    table: str = Field(description="CSV table: curve, x, y")
    shape: str = Field(description="what is read of these curves")


class TestConfig(_Part):
    """A test of the laboratory, or a machine, as it is simulated."""

    __test__ = False  # pytest takes the name for one of its own

    experiment: Literal[tuple(METRICS)] = Field(description="virtual experiment that stands for it")  # type: ignore[valid-type]
    like: str | None = Field(
        None, description="another test that it is but for what it states itself"
    )
    run: dict = Field(
        {}, description="grains, geometry and numerics: what it has beyond the shared `run`"
    )
    fixed: dict[str, float] = Field(
        {},
        description="factor name: its level in this test, whatever it is in the others, as of side "
        "walls that are smooth",
    )
    metrics: list[str] = Field(
        [],
        description="metrics that are predicted and could be measured next; the experiment's main "
        "one and those that were measured unless given",
    )
    sweep: SweepConfig | None = Field(
        None, description="levels of the stage of its experiment: tilt, drop or shear"
    )
    curves: CurvesConfig | None = Field(
        None, description="measured curves; tests with the same one differ in what it runs over"
    )
    diagnosis: dict = Field(
        {},
        description="how the diagnosis simulates tests of this experiment: levers, parameters, "
        "mechanisms, and a `run` that is laid over the test's; what it does not say follows",
    )
    discrepancy: dict[str, Annotated[float, Field(ge=0)]] = Field(
        {},
        description="metric, or shape of the curves: standard deviation by which the model itself "
        "may be wrong, in its unit",
    )


class ScalingConfig(_Part):
    """Heap and drop enlarged by two rules: which of them keeps the responses."""

    factors: list[Positive] = Field(
        [1.0, 2.0, 4.0], min_length=2, description="length factors; the first is compared with"
    )
    seeds: int = Field(6, ge=2, le=100, description="heaps at each scale, beside two drops")
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
    """What was known of a factor before the tests, and who says so: a normal distribution, cut to
    the region."""

    mean: float = Field(description="natural level")
    sd: Positive = Field(description="standard deviation, in the factor's unit")
    source: str = Field(min_length=1, description="where it comes from")


class PosteriorConfig(_Part):
    """The parameters as a distribution, of one test (`posterior`) or of all (`joint`)."""

    draws: int = Field(1000, ge=50, le=10000, description="draws that are kept in the table")
    priors: dict[str, PriorConfig] = Field(
        {}, description="factor name: what is known of it; uniform over its levels where not named"
    )
    readings: int = Field(5, ge=2, description="readings that the next test would take")
    hours: dict[str, Positive] = Field(
        {}, description="test: hours in the laboratory for so many readings; assumed unless given"
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


class PredictConfig(_Part):
    """Tests and machines that are simulated with draws of a posterior."""

    tests: list[str] = Field(
        [], description="names in `tests`; all but the one that the chain is calibrated on"
    )
    draws: int = Field(20, ge=3, le=300, description="draws of the posterior")
    replicates: int = Field(
        2, ge=1, le=20, description="runs with each draw; two tell the seeds' scatter apart"
    )


class JointConfig(_Part):
    """One posterior over all tests that were measured."""

    tests: list[str] = Field([], description="names in `tests` that it runs; all unless given")
    factors: list[str] = Field(
        [], description="factors that are free; all whose levels are numbers unless given"
    )
    runs: int = Field(60, ge=8, le=900, description="points of the common design of all tests")
    repeated: int = Field(
        16, ge=0, le=500, description="of these, points that are run twice, which tells the scatter"
    )
    second_wave: int = Field(
        20, ge=0, le=500, description="points added where the first runs leave the posterior wide"
    )
    machine: str | None = Field(
        None, description="test whose metrics are to be predicted, in place of the parameters"
    )


class CalibrateConfig(_Part):
    """Which parameters the study hands out."""

    by: Literal["chain", "joint", "atlas"] | None = Field(
        None,
        description="chain: those of the surface, of one test; joint: those of all tests "
        "together; atlas: the same, and `joint.runs` stand where the atlas expects the answer and "
        "correct it. Unless given joint where the report waits for the stage `joint`",
    )
    test: str | None = Field(
        None, description="test that the chain calibrates on; the first one unless given"
    )
    to: dict[str, Response] = Field(
        {},
        description="metric of that test: what is asked of it; the experiment's main metric unless "
        "given. Of several the optimum is the most desirable point",
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
    """The whole configuration, and what follows from it: `own` is the test that the chain is
    calibrated on, `own_run` its run spec, `experiment` its experiment, `target` and
    `further_targets` its metrics."""

    @model_validator(mode="before")
    @classmethod
    def _in_key_units(cls, data):
        return alike(coarsened(converted(data))) if isinstance(data, dict) else data

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
        "settings of it, of command or of table",
    )
    measurements: str = Field(
        description="table of all that was measured: experiment, quantity, value, unit, levers ..."
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
    run: dict = Field({}, description="run spec that all tests share: materials and laws")
    tests: dict[str, TestConfig] = Field(
        min_length=1, description="name: a test of the laboratory or a machine, as it is simulated"
    )
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
    scaling: ScalingConfig | None = Field(None, description="the stage `scaling` needs it")
    validation: ValidationConfig = ValidationConfig()
    posterior: PosteriorConfig = PosteriorConfig()
    pour_rate: PourRateConfig | None = Field(None, description="the stage `pour_rate` needs it")
    predict: PredictConfig = PredictConfig()
    joint: JointConfig = JointConfig()
    calibrate: CalibrateConfig = CalibrateConfig()
    published: PublishedConfig = PublishedConfig()
    numerics: str | None = Field(
        None, description="YAML file of points and variants; the stage `numerics` needs it"
    )
    diagnosis: dict = Field({}, description="budget, seed and error rates of the diagnosis")

    @property
    def runs(self) -> str:
        """Folder of the runs, which all studies of `results` share."""
        return f"{self.results}/runs"

    @property
    def own(self) -> str:
        """Name of the test that the chain is calibrated on."""
        return self.calibrate.test or next(iter(self.tests))

    @property
    def experiment(self) -> str:
        """Virtual experiment of that test."""
        return self.tests[self.own].experiment

    @property
    def own_run(self) -> dict[str, Any]:
        """Run spec of that test, without experiment and seed."""
        return self.run_of(self.own)

    @property
    def by_atlas(self) -> bool:
        """Return whether runs of the joint stage correct the atlas."""
        return self.calibrate.by == "atlas"

    def run_of(self, name: str) -> dict[str, Any]:
        """Run spec of a test: what it states laid over what all share."""
        return overlay(self.run, self.tests[name].run)

    def of_experiment(self, experiment: str) -> str | None:
        """Name of the first test of an experiment, one with a sweep before others; None without
        one."""
        own = [name for name, test in self.tests.items() if test.experiment == experiment]
        return min(own, key=lambda name: self.tests[name].sweep is None, default=None)

    @property
    def target(self) -> Target:
        """The main metric that the chain calibrates to."""
        return self._targets()[0]

    @property
    def further_targets(self) -> list[Target]:
        """Further metrics of the same runs that count beside it."""
        return self._targets()[1:]

    def _targets(self):
        asked = self.calibrate.to or {METRICS[self.experiment][0]: Response()}
        return [Target(metric=metric, **dict(asked[metric])) for metric in asked]
