"""Emulators of a study's tests out of the atlas: in place of runs of its own, the runs of the atlas
that are nearest to each of its rigs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from calibration.atlas.rigs import GRAIN, RIGS, UNITS, Input, Rig, energy_of_weight, relative_length
from calibration.atlas.runs import coded, kept, trained
from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.posterior_sampling import Formed
from calibration.study.config import Config
from calibration.study.config.joint import JointTarget, MeasuredMean
from calibration.study.config.specs import overlay
from calibration.study.config.tests import spec_of
from calibration.study.factors import Factor
from dem.contact.catalogue import DEFAULTS
from dem.grains.sizes import clump_shape, mean_radius
from dem.spec import RunSpec

NEAREST = 400
"""Runs of the atlas by which a test is emulated: those nearest to its rig, in lengths over which
the response bends (a local process: Gramacy and Apley 2015, Journal of Computational and Graphical
Statistics 24:561)."""
SLACK = 0.02  # of an input's range, by which a rig may lie beyond it
KEYS = {
    "contacts.particle_particle.static_friction": "grain_friction",
    "contacts.particle_particle.rolling_friction": "grain_rolling",
    "contacts.particle_wall.static_friction": "wall_friction",
    "contacts.particle_wall.rolling_friction": "wall_rolling",
    "contacts.particle_particle.restitution": "restitution",
    "particles.elongation": "elongation",
    "law_parameters.surface_energy_J_m2": "bond_number",
}
"""Keys of a run spec that are inputs of the atlas. No other key moves anything there: the wall's
restitution is taken to be the grains', and Poisson's ratio to be nothing."""


def rig_of(experiment: str) -> Rig | None:
    """The atlas' test of an experiment, None where it has none."""
    return next((r for r in RIGS.values() if r.experiment == experiment), None)


def inputs_of(rig: Rig, spec: RunSpec) -> dict[str, float]:
    """{input: value} of a run spec, whether it lies in the atlas or not."""
    grain = {name: _level(spec, key) / unit_of_level(name, spec) for key, name in KEYS.items()}
    shape = clump_shape(spec)
    longer = as_pair(shape.reach) if shape else spec.particles.elongation
    own = rig.read(spec, diameter_mm(spec), relative_length(longer))
    return grain | {"elongation": longer} | own


def _level(spec, key):
    for name in key.split("."):
        spec = getattr(spec, name, None)  # a law that a spec does not have has no parameter there
    return spec or 0.0


def unit_of_level(name: str, spec: RunSpec) -> float:
    """An input of the grain of 1, as a level of a run spec."""
    if name != "bond_number":
        return 1.0
    return energy_of_weight(1e-3 * diameter_mm(spec), spec.materials.particle.density_kg_m3)


def diameter_mm(spec: RunSpec) -> float:
    """Diameter of the grain of mean volume."""
    return 2e3 * mean_radius(spec)


def as_pair(reach: float) -> float:
    """Length over width of two bonded spheres as long as a clump of the same volume; reach: its
    length in diameters of the sphere of that volume."""
    longest = min(max(reach, 1.0), relative_length(2.0))
    return float(brentq(lambda e: relative_length(e) - longest, 1.0, 2.0))


class Response:
    """A metric of a test over the study's free factors u (k, d) in [0, 1]; as `GaussianProcess`.

    parts: [(weight, process of the atlas, how many times its errors are those that it states)],
    whose inputs (D,) are `base` but for those that a factor moves; unit: of the atlas in that of
    the metric.
    """

    def __init__(
        self,
        parts: Sequence[tuple[float, GaussianProcess, float]],
        base: np.ndarray,
        moved: Sequence[tuple[int, int, Input, float, float]],
        unit: float,
    ) -> None:
        self.parts, self.base, self.moved, self.unit = parts, base, moved, unit

    def inputs(self, u: np.ndarray) -> np.ndarray:
        """Coded inputs (k, D) of the atlas."""
        x = np.tile(self.base, (len(u), 1))
        for k, column, own, low, high in self.moved:
            level = low + u[:, k] * (high - low)
            x[:, column] = own.coded(np.clip(level, own.low, own.high))
        return x

    def mean(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(mean, variance of that mean), (k,) each."""
        x = self.inputs(np.atleast_2d(u))
        weights = self.unit * np.array([w for w, _, _ in self.parts])
        wider = np.array([times for _, _, times in self.parts])
        means, variances = zip(*(p.mean(x) for _, p, _ in self.parts), strict=True)
        return weights @ np.array(means), (weights * wider) ** 2 @ np.array(variances)

    def sd_of_run(self, u: np.ndarray) -> np.ndarray:
        """Standard deviation (k,) of a single run about the mean."""
        x = self.inputs(np.atleast_2d(u))
        own = [w * p.sd_of_run(x) for w, p, _ in self.parts]
        return np.asarray(self.unit * np.linalg.norm(own, axis=0))


class AtlasEmulators:
    """`calibration.chain.joint.analysis.Emulators` of a study's tests, out of the atlas.

    factors: the free ones. Raises CalibrationError where all tests lie outside the atlas, naming
    what does, and by how much.
    """

    def __init__(self, config: Config, factors: Sequence[Factor]) -> None:
        self.config, self.factors = config, factors
        names = [n for n, t in config.tests.items() if rig_of(t.experiment)]
        self._specs = {name: spec_of(config, name) for name in names}
        self._faults = {name: "; ".join(self._outside(name)) for name in names}
        self.tests = [name for name, faults in self._faults.items() if not faults]
        if not self.tests:
            told = "; ".join(self._faults.values()) or "no test of the study is in it"
            raise CalibrationError(f"outside the atlas: {told}")
        self._of: dict[tuple[str, str], Response] = {}
        runs = [pd.DataFrame({"rig": n}, index=kept(self._rig(n).name).index) for n in self.tests]
        self.design = pd.concat(runs)

    def _rig(self, test):
        return rig_of(self.config.tests[test].experiment)

    def _moved(self, test):
        """[(factor's number, input's column, input, low, high)] of the inputs that factors move."""
        rig, spec = self._rig(test), self._specs[test]
        names = [i.name for i in rig.all_inputs]
        for k, f in enumerate(self.factors):
            if KEYS.get(f.key) and f.name not in self.config.tests[test].fixed:
                column = names.index(KEYS[f.key])
                unit = unit_of_level(KEYS[f.key], spec)
                yield k, column, rig.all_inputs[column], f.low / unit, f.high / unit

    def _beyond(self, test):
        """(input, its value, the end that it lies beyond, low or high) of a test; those that
        factors move have been cut to the atlas."""
        rig = self._rig(test)
        moved = {own.name for _, _, own, _, _ in self._moved(test)}
        at = inputs_of(rig, self._specs[test])
        for own in (i for i in rig.all_inputs if i.name not in moved):
            x = own.coded(at[own.name])
            if not -SLACK <= x <= 1.0 + SLACK:
                yield own, at[own.name], "low" if x < 0.0 else "high"

    def _outside(self, test):
        """Sentences on inputs of a test that lie outside the atlas, whose plates are bare."""
        for key in ("plate_rim_height_mm", "plate_stl"):
            if found := getattr(self._specs[test].geometry, key, None):
                yield f"tests.{test}: {key} is {found}; allowed: none, a plate without a rim"
        for own, value, end in self._beyond(test):
            if own.beyond != end:
                allowed = f"{own.low:g} to {own.high:g}"
                yield f"tests.{test}: {own.meaning} is {value:.3g}; allowed: {allowed}"

    def counted(self) -> Iterator[str]:
        """Sentences on inputs that count as the end that they lie beyond, but for a vessel, whose
        wall has its share taken off (`_parts`); and on laws that are not the atlas'."""
        for test in self.tests:
            for slot, own in DEFAULTS.items():
                law = getattr(self._specs[test].laws, slot)
                if law != own and slot != "cohesion":  # which is an input
                    yield (
                        f"{test}: the law of {slot} is {law}, and {own} in the atlas: what it "
                        "tells may differ"
                    )
            for own, value, end in self._beyond(test):
                if own.name != "vessel":
                    yield (
                        f"{test}: {own.meaning} is {value:.3g} and counts as "
                        f"{getattr(own, end):g}: the atlas ends there; what is beyond may differ"
                    )

    def of(self, test: str, metric: str) -> Response:
        """The emulator of a metric. Raises CalibrationError where the atlas does not have it."""
        if (test, metric) not in self._of:
            self._of[test, metric] = self._made(test, metric)
        return self._of[test, metric]

    def _made(self, test, metric):
        if not self.has(test, metric):
            raise CalibrationError(f"tests.{test}: the atlas has no {metric} of it")
        rig, spec = self._rig(test), self._specs[test]
        at = inputs_of(rig, spec)
        base = np.array([np.clip(i.coded(at[i.name]), 0.0, 1.0) for i in rig.all_inputs])
        moved = list(self._moved(test))
        diameter, density = 1e-3 * diameter_mm(spec), spec.materials.particle.density_kg_m3
        near = [
            (w, nearest(rig.name, m, base, [k[1] for k in moved]), trained(rig.name)[m]["wider"])
            for w, m in _parts(rig, spec, at, metric)
        ]
        return Response(near, base, moved, UNITS[rig.readings[metric]](diameter, density))

    def has(self, test: str, metric: str) -> bool:
        """Return whether the atlas has a metric of a test."""
        return test in self.tests and metric in self._rig(test).readings

    def known(self, test: str, metrics: Sequence[str]) -> dict[str, Response]:
        """{metric: emulator} of those metrics that the atlas has."""
        return {m: self.of(test, m) for m in metrics if self.has(test, m)}

    def told(self, measured: Mapping[JointTarget, MeasuredMean]) -> dict[JointTarget, MeasuredMean]:
        """Of what was measured the targets that the atlas has. Raises CalibrationError for none."""
        found = {t: m for t, m in measured.items() if self.has(t.test, t.metric)}
        if not found:
            faults = "; ".join(filter(None, self._faults.values()))
            titles = ", ".join(rig.title for rig in RIGS.values())
            known = f"nothing was measured that it has; allowed: {titles}"
            raise CalibrationError(f"outside the atlas: {faults or known}")
        return found

    def left_out(self, measured: Mapping[JointTarget, MeasuredMean]) -> list[str]:
        """Sentences on the targets that are not `told`, and why."""
        told = self.told(measured)
        return [
            f"the atlas tells nothing of {t.name}: {self._faults.get(t.test) or 'it has none'}"
            for t in measured if t not in told
        ]  # fmt: skip

    def values(self, test: str, metric: str) -> np.ndarray:
        """(n,) values of a metric of the atlas' runs, nan where a run gave none."""
        return kept(self._rig(test).name)[metric].to_numpy(float)

    def formed(self, test: str, metric: str, tests: float) -> Formed:
        """`Formed` of `tests` of a rig that gave a metric: over the study's free factors, without
        slopes."""
        own, response = chance(self._rig(test).name), self.of(test, metric)
        odds = SimpleNamespace(with_slope=lambda u, _: own.with_slope(response.inputs(u), []))
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
    has = np.isfinite(y)
    x, y = x[has], y[has]
    rest = [k for k in range(x.shape[1]) if k not in free]
    smooth = np.exp(known[0][1 : 1 + x.shape[1]])  # behind the smooth part's share
    apart = (((x - at) / smooth)[:, rest] ** 2).sum(axis=1)
    near = np.argsort(apart, kind="stable")[:NEAREST]
    return GaussianProcess().fit(x[near], y[near], known)


def _parts(rig, spec, at, metric):
    """[(weight, metric of the atlas)]: a density in a vessel that is wider than the atlas' widest,
    or than is simulated, lies between that in the narrow one and the core's, as the share of the
    layer at the wall goes as one over the width (`dem.experiments.bulk_density`)."""
    if metric != "poured_density_kg_m3":
        return [(1.0, metric)]
    length = relative_length(at["elongation"]) * diameter_mm(spec)
    share = min(at["vessel"], rig.input("vessel").high) * length / spec.geometry.vessel_diameter_mm
    return [(share, metric)] + ([(1.0 - share, "poured_solid_fraction")] if share < 1.0 else [])


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
    found, said = [], []
    grain = {i.name: i for i in GRAIN}
    spec = spec_of(config, config.own)
    for f in factors:
        name = KEYS.get(f.key)
        if name is None:
            continue
        unit = unit_of_level(name, spec)
        low, high = (unit * end for end in (grain[name].low, grain[name].high))
        if f.high <= low or f.low >= high:
            raise CalibrationError(
                f"{f.name}: {f.low:g} to {f.high:g} lies outside the atlas; allowed: {low:.3g} to "
                f"{high:.3g}"
            )
        cut = replace(f, low=max(f.low, low), high=min(f.high, high))
        if (cut.low, cut.high) != (f.low, f.high):
            said.append(f"{f.name} is taken from {cut.low:.3g} to {cut.high:.3g}: the atlas ends "
                        f"there (its range: {f.low:g} to {f.high:g})")  # fmt: skip
        found.append(cut)
    return found, said
