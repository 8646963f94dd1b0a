"""Emulators of a study's tests out of the atlas: in place of runs of its own, the runs of the atlas
that are nearest to each of its rigs."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pandas as pd

from calibration.atlas.rigs import BY_EXPERIMENT, GRAIN, RIGS, Grain, Rig, as_pair, size_of_unit
from calibration.atlas.runs import coded, kept, trained
from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.posterior_sampling import Formed
from calibration.study.config import Config
from calibration.study.config.joint import JointTarget, MeasuredMean, joint_targets, measured_of
from calibration.study.config.specs import overlay
from calibration.study.config.tests import spec_of
from calibration.study.factors import Factor
from dem.contact.catalogue import DEFAULTS
from dem.grains.sizes import clump_shape, mean_radius
from dem.spec import RunSpec

NEAREST = 400
"""Runs of the atlas by which a test is emulated, nearest to its rig in lengths over which the
response bends (a local process: Gramacy and Apley 2015, J. Comput. Graph. Stat. 24:561)."""
HAS = ", ".join(rig.title for rig in RIGS.values())
SLACK = 0.02  # of an input's range, by which a rig may lie beyond it


def grain_of(spec: RunSpec) -> Grain:
    """The mean grain of a run spec."""
    return Grain(2e3 * mean_radius(spec), spec.materials.particle.density_kg_m3)


def inputs_of(rig: Rig, spec: RunSpec) -> dict[str, float]:
    """{input: value} of a run spec, whether it lies in the atlas or not."""
    at: dict[str, float] = {}
    grain = grain_of(spec)
    for own in rig.all_inputs:
        at[own.name] = own.read(_level(spec, own.key), at, grain)
    if getattr(spec.geometry, "feed", None) == "opened":
        at["feed"] = 1.0
    return at


def _level(spec, key):
    """The level of a key as the atlas has it: of a clump as of a pair, of a vessel as simulated."""
    shape = clump_shape(spec)
    if shape and key == "particles.elongation":
        return as_pair(shape.reach)
    if key == "geometry.vessel_diameter_mm":
        return spec.geometry.simulated_diameter_mm or spec.geometry.vessel_diameter_mm
    for name in key.split("."):
        spec = getattr(spec, name, None)  # a law that a spec does not have has no parameter there
    return spec or 0.0


class Setting:
    """A test of a study in the atlas: its rig, run spec and {input: value}, and which of these the
    study's factors move."""

    def __init__(self, config: Config, name: str, factors: Sequence[Factor]) -> None:
        test = config.tests[name]
        self.name, self.rig, self.spec = name, BY_EXPERIMENT[test.experiment], spec_of(config, name)
        self.grain, self.at = grain_of(self.spec), inputs_of(self.rig, self.spec)
        own = [i.coded(self.at[i.name]) for i in self.rig.all_inputs]
        self.base = np.clip(own, 0.0, 1.0)
        self.moved = [
            (k, column, *(own.read(end, self.at, self.grain) for end in (f.low, f.high)))
            for k, f in enumerate(factors)
            for column, own in enumerate(GRAIN)
            if own.key == f.key and f.name not in test.fixed
        ]
        """[(factor's number, input's column, its value at the factor's low level, at its high)]."""
        self.free = [column for _, column, *_ in self.moved]
        self.sticks = self.at["bond_number"] > 0.0 or "bond" in [GRAIN[c].of for c in self.free]
        self.outside, self.counted = self._judged()

    def inputs(self, u: np.ndarray) -> np.ndarray:
        """Coded inputs (k, D) of the atlas at levels u (k, d) in [0, 1] of the factors."""
        x = np.tile(self.base, (len(u), 1))
        for k, column, low, high in self.moved:
            own, level = GRAIN[column], low + u[:, k] * (high - low)
            x[:, column] = own.coded(np.clip(level, own.low, own.high))
        return x

    def _judged(self):
        """(what lies outside the atlas, whose plates are bare; what counts as what the atlas has),
        sentences: laws, but cohesion, which is an input; and inputs that no factor moves, but a
        vessel, whose wall has its share taken off (`parts`). Factors have been cut to the atlas."""
        outside, counted = [], []
        for key in ("plate_rim_height_mm", "plate_stl"):
            if found := getattr(self.spec.geometry, key, None):
                outside.append(f"{key} is {found}; allowed: none, a plate without a rim")
        for slot in (s for s in DEFAULTS if s != "cohesion"):
            law, own = getattr(self.spec.laws, slot), DEFAULTS[slot]
            if law != own:
                told = f"the law of {slot} is {law}, and {own} in the atlas"
                counted.append(f"{self.name}: {told}: what it tells may differ")
        for own in (i for k, i in enumerate(self.rig.all_inputs) if k not in self.free):
            value, x = self.at[own.name], own.coded(self.at[own.name])
            end, told = "low" if x < 0.0 else "high", f"{own.meaning} is {value:.3g}"
            if -SLACK <= x <= 1.0 + SLACK:
                continue
            if own.beyond != end:
                outside.append(f"{told}; allowed: {own.low:g} to {own.high:g}")
            elif own.name != "vessel":
                told += f" and counts as {getattr(own, end):g}: the atlas ends there"
                counted.append(f"{self.name}: {told}; what is beyond may differ")
        return "; ".join(f"tests.{self.name}: {fault}" for fault in outside), counted

    def parts(self, metric: str) -> list[tuple[float, str]]:
        """[(weight in the metric's unit, metric of the atlas)]: a density in a vessel that is wider
        than the atlas' widest, or than is simulated, lies between that in the narrow one and the
        core's, as the share of the layer at the wall goes as one over the width
        (`dem.experiments.bulk_density`)."""
        unit = size_of_unit(metric, self.grain)
        if metric != "poured_density_kg_m3":
            return [(unit, metric)]
        own = self.rig.input("vessel")
        narrow = own.level(min(self.at["vessel"], own.high), self.at, self.grain)
        share = narrow / self.spec.geometry.vessel_diameter_mm
        core = [(unit * (1.0 - share), "poured_solid_fraction")] if share < 1.0 else []
        return [(unit * share, metric), *core]


@dataclass(frozen=True)
class Response:
    """A metric of a test over the study's free factors u (k, d) in [0, 1]; as `GaussianProcess`.

    parts: [(weight, process of the atlas, how many times its errors are those that it states)],
    whose sum is the metric in its unit; inputs: u -> coded inputs (k, D) of these.
    """

    parts: Sequence[tuple[float, GaussianProcess, float]]
    inputs: Callable[[np.ndarray], np.ndarray]

    def mean(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each."""
        x = self.inputs(np.atleast_2d(u))
        weights, wider = np.array([(w, times) for w, _, times in self.parts]).T
        means, variances = zip(*(p.mean(x) for _, p, _ in self.parts), strict=True)
        return weights @ np.array(means), (weights * wider) ** 2 @ np.array(variances)

    def sd_of_run(self, u: np.ndarray) -> np.ndarray:
        """Standard deviation (k,) of a single run about the mean."""
        x = self.inputs(np.atleast_2d(u))
        own = [w * p.sd_of_run(x) for w, p, _ in self.parts]
        return np.asarray(np.linalg.norm(own, axis=0))


class AtlasEmulators:
    """`calibration.chain.joint.analysis.Emulators` of a study's tests, out of the atlas.

    factors: the free ones; tests: those of the study that lie in the atlas."""

    def __init__(self, config: Config, factors: Sequence[Factor]) -> None:
        names = [n for n, t in config.tests.items() if t.experiment in BY_EXPERIMENT]
        settings = {name: Setting(config, name, factors) for name in names}
        self.config, self.factors = config, factors
        self._faults = {name: own.outside for name, own in settings.items()}
        self._settings = {n: own for n, own in settings.items() if not own.outside}
        self.tests = list(self._settings)
        self._of: dict[tuple[str, str], Response] = {}
        runs = [len(kept(own.rig.name)) for own in self._settings.values()]
        self.design = pd.DataFrame({"rig": np.repeat(self.tests, runs)})

    def of(self, test: str, metric: str) -> Response:
        """The emulator of a metric. Raises CalibrationError where the atlas does not have it."""
        if not self.has(test, metric):
            raise CalibrationError(f"tests.{test}: the atlas has no {metric} of it")
        if (test, metric) not in self._of:
            own = self._settings[test]
            name = own.rig.name
            near = [
                (w, nearest(name, m, own.base, own.free), trained(name)[m]["wider"][own.sticks])
                for w, m in own.parts(metric)
            ]
            self._of[test, metric] = Response(near, own.inputs)
        return self._of[test, metric]

    def has(self, test: str, metric: str) -> bool:
        """Return whether the atlas has a metric of a test."""
        return test in self.tests and metric in self._settings[test].rig.readings

    def told(self) -> tuple[dict[JointTarget, MeasuredMean], list[str]]:
        """(the targets that the atlas has of what was measured, `said` of all). Raises
        CalibrationError where it has none, and ConfigError for a table that cannot be read."""
        measured = measured_of(self.config, joint_targets(self.config))
        found = {t: m for t, m in measured.items() if self.has(t.test, t.metric)}
        if not found:
            faults = "; ".join(filter(None, self._faults.values()))
            raise CalibrationError(f"outside the atlas: {faults or f'none is measured of {HAS}'}")
        return found, self.said(measured)

    def said(self, targets: Iterable[JointTarget]) -> list[str]:
        """Sentences on what of the tests counts as what the atlas has, and on the targets that it
        does not tell, and why."""
        counted = [sentence for own in self._settings.values() for sentence in own.counted]
        return counted + [
            f"the atlas tells nothing of {t.name}: {self._faults.get(t.test) or f'it has {HAS}'}"
            for t in targets if not self.has(t.test, t.metric)
        ]  # fmt: skip

    def values(self, test: str, metric: str) -> np.ndarray:
        """(n,) values of a metric of the atlas' runs, nan where a run gave none."""
        return kept(self._settings[test].rig.name)[metric].to_numpy(float)

    def formed(self, test: str, metric: str, tests: float) -> Formed:
        """`Formed` of `tests` of a rig that gave a metric: over the study's free factors, without
        slopes."""
        setting = self._settings[test]
        own = chance(setting.rig.name)
        odds = SimpleNamespace(predict=lambda u: own.predict(setting.inputs(u)))
        return Formed(odds, tests)  # type: ignore[arg-type]


@cache
def chance(name: str) -> Chance:
    """How likely a run of a test gives no value."""
    failed = kept(name)["fault"].notna().to_numpy()
    return Chance(coded(RIGS[name], kept(name)), failed, np.ones(len(failed)))


def nearest(name: str, metric: str, at: np.ndarray, free: Sequence[int]) -> GaussianProcess:
    """The process of a metric, trained by the runs nearest to `at` (D,) in all inputs but the
    `free` ones, with the lengths of all."""
    x, y = coded(RIGS[name], kept(name)), kept(name)[metric].to_numpy(float)
    known = trained(name)[metric]["process"]
    x, y = x[np.isfinite(y)], y[np.isfinite(y)]
    smooth = np.exp(known[0][1 : 1 + x.shape[1]])  # behind the smooth part's share
    apart = np.delete(((x - at) / smooth) ** 2, free, axis=1).sum(axis=1)
    near = np.argsort(apart, kind="stable")[:NEAREST]
    return GaussianProcess().fit(x[near], y[near], known)


def poured_as_atlas(config: Config) -> tuple[Config, list[str]]:
    """(configuration whose heaps are poured of as many grains as the atlas has, sentences on those
    that were of more or fewer): a laboratory pours what its plate takes, and the rest rolls off."""
    tests, said, rig = dict(config.tests), [], RIGS["heap"]
    own = rig.input("filling")
    for name in (n for n, t in tests.items() if t.experiment == rig.experiment):
        spec = spec_of(config, name)
        share, count = inputs_of(rig, spec)["filling"], spec.particles.count
        poured = round(count * min(max(share, own.low), own.high) / share)
        if poured != count:
            run = overlay(tests[name].run, {"particles": {"count": poured}})
            tests[name] = tests[name].model_copy(update={"run": run})
            said.append(f"{name}: the atlas is asked for {poured:,} grains in place of {count:,}, "
                        "the nearest that it has on such a plate")  # fmt: skip
    return config.model_copy(update={"tests": tests}), said


def cut_to_atlas(config: Config, factors: Sequence[Factor]) -> tuple[list[Factor], list[str]]:
    """(factors whose levels lie in the atlas, sentences on those that were cut). Raises
    CalibrationError for one whose levels all lie outside."""
    found, said, grain = [], [], grain_of(spec_of(config, config.own))
    for f, own in ((f, i) for f in factors for i in GRAIN if i.key == f.key):
        low, high = (own.level(end, {}, grain) for end in (own.low, own.high))
        if f.high <= low or f.low >= high:
            raise CalibrationError(
                f"{f.name}: {f.low:g} to {f.high:g} lies outside the atlas; allowed: {low:.3g} to "
                f"{high:.3g}"
            )
        cut = replace(f, low=max(f.low, low), high=min(f.high, high))
        if cut != f:
            said.append(f"{f.name} is taken from {cut.low:.3g} to {cut.high:.3g}: the atlas ends "
                        f"there (its range: {f.low:g} to {f.high:g})")  # fmt: skip
        found.append(cut)
    return found, said
