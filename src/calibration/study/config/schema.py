"""The schema of a study's configuration: every key with its unit, range and default. What each of
them means stands in `keys.yaml`."""

from importlib.resources import files
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, model_validator

from calibration.study.config.specs import overlay
from dem.experiments import experiments
from dem.units import converted

Positive = Annotated[float, Field(gt=0)]
MEANINGS = yaml.safe_load(
    files("calibration.study.config").joinpath("keys.yaml").read_text("utf-8")
)


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        for key, meaning in MEANINGS.get(cls.__name__, {}).items():
            cls.model_fields[key].description = meaning
        cls.model_rebuild(force=True)


COARSER = {"quick": 4.0, "test": 8.0}
"""Resolution -> how many times fewer grains."""


def coarsened(data: dict[str, Any]) -> dict[str, Any]:
    """A configuration whose `resolution` is carried out: fewer, larger grains in the test that it
    calibrates on, and a name that says so."""
    factor = COARSER.get(str(data.get("resolution")))
    if factor is None:
        return data
    try:
        own: Any = (data.get("calibrate") or {}).get("test") or next(iter(data["tests"]), None)
        run = overlay(data.get("run", {}), data["tests"][own].get("run", {}))
        particles, geometry = run["particles"], run.get("geometry") or {}
        grown, changes = factor ** (1 / 3), {}
        if particles.get("diameter_mm") is not None:
            larger = {"diameter_mm": round(grown * particles["diameter_mm"], 4)}
        else:
            larger = {"scale_factor": round(grown * particles.get("scale_factor", 1.0), 6)}
        changes["particles"] = larger | {"count": max(round(particles["count"] / factor), 1)}
        if (rate := geometry.get("generation_rate_per_s")) is not None:
            changes["geometry"] = {"generation_rate_per_s": rate / factor}
        tests = overlay(data["tests"], {own: {"run": changes}})
    except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError):
        return data  # it pours no grains, or the schema says what is not well formed
    name = f"{data.get('name')}-{data['resolution']}"
    return data | {"tests": tests, "name": name, "resolution": "full"}


VIEWS = ("own", "experiment", "own_run", "target", "by_atlas")
"""What follows from a `Config`'s sections and what a stage may read in their place."""

METRICS = {name: e.targets for name, e in experiments().items()}
"""What a run of each experiment can be calibrated to; the unit is in the name."""


class ScreeningConfig(_Part):
    """Screening of all factors."""

    alpha: float = Field(0.05, gt=0, lt=1)
    replicates: int = Field(1, ge=1, le=20)
    kind: Literal["resolution_iv", "plackett_burman"] = "resolution_iv"
    centre_runs: int = Field(3, ge=0, le=20)
    foldover: bool = False
    runs: int | None = Field(None, ge=4)
    design: str | None = None
    go_on: list[str] | None = None
    at_least: int = Field(3, ge=1)
    at_most: int = Field(3, ge=1, le=7)


class AscentConfig(_Part):
    """Steepest ascent."""

    steps: int = Field(5, ge=2, le=50)
    replicates: int = Field(1, ge=1, le=20)
    rule: Literal["configured", "effects"] = "configured"
    start: dict[str, float] = {}
    step: dict[str, float] = {}


class SurfaceConfig(_Part):
    """Box-Behnken response surface around the ascent's best point."""

    centre: dict[str, float] = {}
    half_width: dict[str, Positive] = {}
    centre_runs: int = Field(5, ge=2, le=20)
    replicates: int = Field(1, ge=1, le=20)


class OptimiseConfig(_Part):
    """Runs at the point that meets the target."""

    candidate_runs: int = Field(10, ge=0, le=100)
    candidate_half_width: Positive | None = None
    candidate_at_most: int = Field(100, ge=2, le=1000)


class ValidationConfig(_Part):
    """Replicate runs at the optimum."""

    groups: int = Field(5, ge=1, le=50)
    replicates: int = Field(5, ge=1, le=50)
    margin: float = Field(1.0, gt=0)
    alpha: float = Field(0.05, gt=0, lt=1)


class SweepConfig(_Part):
    """One factor swept over a test; the level that gives the measured value is read off."""

    levels: list[Positive] = Field(min_length=3)
    confirmations: int = Field(5, ge=1, le=50)
    normal_stresses_kPa: list[Positive] = []
    replicates: int = Field(3, ge=1, le=50)


class TestConfig(_Part):
    """A test of the laboratory, or a machine, as it is simulated."""

    __test__ = False  # pytest takes the name for one of its own

    experiment: Literal[tuple(METRICS)]  # type: ignore[valid-type]
    run: dict = {}
    fixed: dict[str, float] = {}
    metrics: list[str] = []
    sweep: SweepConfig | None = None
    diagnosis: dict = {}
    discrepancy: dict[str, Annotated[float, Field(ge=0)]] = {}


class ScalingConfig(_Part):
    """Heap and drop enlarged by two rules: which of them keeps the responses."""

    factors: list[Positive] = Field([1.0, 2.0, 4.0], min_length=2)
    seeds: int = Field(6, ge=2, le=100)
    margin_deg: Positive = 2.0
    margin_restitution: Positive = 0.02
    point: dict[str, float] = {}
    cohesion: dict
    heap: dict = {}
    drop: dict = {}


class PriorConfig(_Part):
    """What was known of a factor before the tests, and who says so: a normal distribution, cut to
    the region."""

    mean: float
    sd: Positive
    source: str = Field(min_length=1)


class PosteriorConfig(_Part):
    """The parameters as a distribution, of one test (`posterior`) or of all (`joint`)."""

    draws: int = Field(1000, ge=50, le=10000)
    priors: dict[str, PriorConfig] = {}
    readings: int = Field(5, ge=2)
    hours: dict[str, Positive] = {}


class PredictConfig(_Part):
    """Tests and machines that are simulated with draws of a posterior."""

    tests: list[str] = []
    draws: int = Field(20, ge=3, le=200)
    replicates: int = Field(2, ge=1, le=5)


class JointConfig(_Part):
    """One posterior over all tests that were measured."""

    tests: list[str] = []
    factors: list[str] = []
    # together, as draws times replicates above, no more than SEEDS_A_STAGE
    runs: int = Field(60, ge=8, le=600)
    repeated: int = Field(16, ge=0, le=200)
    second_wave: int = Field(20, ge=0, le=200)
    machine: str | None = None


class CalibrateConfig(_Part):
    """Which parameters the study hands out."""

    by: Literal["chain", "joint", "atlas"] | None = None
    test: str | None = None
    to: str | None = None


class PublishedConfig(_Part):
    """Values printed elsewhere, which calibrated.yaml sets beside this study's."""

    tables: dict[str, str | None] = {}
    names: dict[str, str] = {}


class Config(_Part):
    """The whole configuration, and what follows from it: `own` is the test that the chain is
    calibrated on, `own_run` its run spec, `experiment` its experiment, `target` the metric."""

    @model_validator(mode="before")
    @classmethod
    def _in_key_units(cls, data):
        return coarsened(converted(data)) if isinstance(data, dict) else data

    name: str = Field(pattern=r"^[A-Za-z0-9_-]+$")
    results: str = Field("results", pattern=r"^[^{}*?<>|\s]([^{}*?<>|]*[^{}*?<>|\s/])?$")
    seed: int = Field(1, ge=0, lt=2**31)
    factors: str
    engine: str | dict = "dem"
    measurements: str
    supplements: list[str] = []
    fixed: dict[str, float] = {}
    fixed_from: Literal["config", "bench"] = "config"
    run: dict = {}
    tests: dict[str, TestConfig] = Field(min_length=1)
    resolution: Literal["full", *COARSER] = "full"  # type: ignore[valid-type]
    runs_per_job: int | None = Field(None, ge=1, le=100_000)
    screening: ScreeningConfig = ScreeningConfig()
    ascent: AscentConfig = AscentConfig()
    response_surface: SurfaceConfig = SurfaceConfig()
    optimise: OptimiseConfig = OptimiseConfig()
    scaling: ScalingConfig | None = None
    validation: ValidationConfig = ValidationConfig()
    posterior: PosteriorConfig = PosteriorConfig()
    predict: PredictConfig = PredictConfig()
    joint: JointConfig = JointConfig()
    calibrate: CalibrateConfig = CalibrateConfig()
    published: PublishedConfig = PublishedConfig()
    numerics: str | None = None
    diagnosis: dict = {}

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
    def target(self) -> str:
        """The metric that the chain calibrates to."""
        return self.calibrate.to or METRICS[self.experiment][0]
