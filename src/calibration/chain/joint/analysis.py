"""The posterior of one test or of several, that emulators of all metrics of all rigs give,
criticised by itself: parameters, targets, contradictions, borders; and what its draws expect of
every rig: which test to make next, and which parameter each metric owes its spread."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.distance import cdist

from calibration.atlas.emulators import AtlasEmulators
from calibration.errors import CalibrationError
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.gaussian_process import GaussianProcess
from calibration.inference.joint import critique
from calibration.inference.joint.likelihood import Cloud, Joint, Response
from calibration.inference.joint.next_test import Candidate, pushed, rank, shares
from calibration.inference.posterior_sampling import Formed, Prior
from calibration.runs.plans import read_values
from calibration.statistics.ties import first_least
from calibration.study.config import Config
from calibration.study.config.joint import JointTarget, MeasuredMean
from calibration.study.factors import physical_range
from dem.experiments import experiments
from dem.tables import read_table

LEAST_TESTS = 1
"""Tests of the laboratory behind a mean whose number of readings nobody states."""


class Emulators:
    """Emulators of any metric of any rig over the free factors, trained by a design's runs.

    factors: the free ones (d); design: table of finished runs with the columns rig, run_id and one
    for each factor; atlas: that these correct in the tests that it has.
    """

    def __init__(
        self, factors: Sequence[Any], design: pd.DataFrame, atlas: AtlasEmulators | None = None
    ) -> None:
        self.factors, self.design, self.atlas = factors, design, atlas
        self._kept: dict[tuple[str, str], GaussianProcess] = {}

    def inputs(self, rig: str) -> tuple[pd.DataFrame, np.ndarray]:
        """(table of the rig's runs, their levels (n, d) in [0, 1])."""
        runs = self.design[self.design["rig"] == rig].reset_index(drop=True)
        levels = [0.5 + 0.5 * f.coded(runs[f.name].to_numpy(float)) for f in self.factors]
        return runs, np.column_stack(levels)

    def values(self, rig: str, metric: str) -> np.ndarray:
        """(n,) values of a metric of the rig's runs, nan where a run gave none."""
        runs, _ = self.inputs(rig)
        return read_values(runs["run_id"], metric)

    def of(self, rig: str, metric: str) -> GaussianProcess:
        """The emulator of a metric. Raises CalibrationError naming rig and metric where too few
        runs gave a value, or all the same."""
        if (rig, metric) not in self._kept:
            _, u = self.inputs(rig)
            values = self.values(rig, metric)
            has = np.isfinite(values)
            atlas = self.atlas
            before = atlas.of(rig, metric) if atlas and atlas.has(rig, metric) else None
            try:
                self._kept[rig, metric] = GaussianProcess(before).fit(u[has], values[has])
            except CalibrationError as error:
                raise CalibrationError(f"rig {rig}, {metric}: {error}") from None
        return self._kept[rig, metric]

    def formed(self, rig: str, metric: str, tests: float) -> Formed | None:
        """`Formed` of `tests` of a rig that gave a metric; None where no run lacks it."""
        _, u = self.inputs(rig)
        failed = ~np.isfinite(self.values(rig, metric))
        return Formed(Chance(u, failed, np.ones(len(u))), tests) if failed.any() else None  # type: ignore[arg-type]  # infinite where a mean is stated


def joint_of(
    config: Config, emulators: Emulators, measured: Mapping[JointTarget, MeasuredMean]
) -> Joint:
    """The `Joint` of what was measured. Raises CalibrationError for a target that its runs do not
    tell."""
    responses, formed = [], {}
    for target, mean in measured.items():
        emulator = emulators.of(target.test, target.metric)
        known = mean.mean, mean.variance, mean.freedom, target.discrepancy
        responses.append(Response(target.name, emulator, *known))
        tests = mean.freedom + 1 if np.isfinite(mean.freedom) else LEAST_TESTS
        if own := emulators.formed(target.test, target.metric, tests):
            formed[target.test] = own
    prior = prior_of(config, emulators.factors)
    return Joint(tuple(responses), prior, tuple(formed.values()))


def prior_of(config: Config, factors: Sequence[Any]) -> Prior:
    """The `Prior` of the free factors (d): flat over their levels where `posterior.priors` names
    none."""
    mean, sd = np.full(len(factors), 0.5), np.full(len(factors), np.inf)
    for k, f in enumerate(factors):
        if f.name in config.posterior.priors:
            known = config.posterior.priors[f.name]
            mean[k] = 0.5 + 0.5 * f.coded(known.mean)
            sd[k] = 0.5 * known.sd / f.half_range
    return Prior(mean, sd)


PRIOR_DRAWS = 20000
INSIDE = 0.05
"""Share of a factor's levels that its interval leaves free at both ends where the targets bound
it."""


def analysed(
    config: Config,
    emulators: Emulators,
    measured: Mapping[JointTarget, MeasuredMean],
    tests: Mapping[str, Sequence[str]],
    machine: str | None = None,
) -> tuple[dict[str, Any], dict[str, pd.DataFrame]]:
    """Sample the posterior of what was measured, criticise it, and find which test to make next.
    Returns the summary for JSON, and tables by their names.

    tests: {test: its metrics that are predicted and could be measured next}; machine: the test
    whose prediction should become narrow, in place of the parameters."""
    factors, design = emulators.factors, emulators.design
    whole = joint_of(config, emulators, measured)
    posterior = whole.posterior(config.seed)
    parameters = _parameters(factors, config.experiment, posterior, whole.prior)
    criticism = _criticism(config, whole, measured, posterior.draws)
    following = next_tests(config, emulators, measured, tests, posterior.draws, machine)
    u = critique.thinned(posterior.draws, config.posterior.draws)
    coded = 2.0 * u.T - 1.0
    natural = {f.name: f.natural(levels) for f, levels in zip(factors, coded, strict=True)}
    draws, order = pd.DataFrame(natural), np.arange(len(u))
    first = middle(draws, np.column_stack([r.emulator.mean(u)[0] for r in whole.responses]))
    order[[0, first]] = first, 0
    tables = {
        "draws": draws.iloc[order],
        "parameters": _as_table(parameters),
        "targets": _targets(whole, criticism["targets"]),
        "next": following,
        "predictions": predictions(config, emulators, tests, posterior.draws),
    }
    known = {k: p for k, p in config.posterior.priors.items() if k in parameters}
    found = {
        "parameters": parameters,
        "correlation": np.atleast_2d(np.corrcoef(posterior.draws.T)).tolist(),
        "level": LEVEL,
        "box": {f.name: [f.low, f.high] for f in factors},
        "priors": {k: p.model_dump() for k, p in known.items()},
        "without_value": _without_value(emulators, measured),
        "runs": {name: int((design["rig"] == name).sum()) for name in tests},
        "sampler": {
            "draws": len(posterior.draws),
            "effective": posterior.effective,
            "autocorrelation": posterior.autocorrelation,
            "accepted": posterior.accepted,
            "converged": posterior.converged,
        },
        "readings": config.posterior.readings,
        "machine": machine,
        "next_test": following.to_dict("records"),
    }
    return found | criticism, tables


def middle(draws: pd.DataFrame, expected: np.ndarray) -> int:
    """Row of the draw that stands for all (n, d): the medoid of the half of them that expects the
    most usual of the measured values, expected (n, m).

    The means of parameters that hang together are no set that meets the measurements; a draw is
    one. A surface of equal response is curved, so the medoid of all draws may lie beside it.
    """
    shape = np.linalg.pinv(np.atleast_2d(np.cov(expected, rowvar=False)))
    away = cdist(expected, expected.mean(axis=0)[None], "mahalanobis", VI=shape)[:, 0]
    usual = np.flatnonzero(away <= np.median(away))
    return int(usual[medoid(draws.to_numpy(float)[usual])])


def medoid(values: np.ndarray) -> int:
    """Row of values (n, d) with the least distance to all others, by their covariance
    (Mahalanobis). Of rows that are as near but for rounding, the first one is taken."""
    sd = values.std(axis=0)
    scaled = values / np.where(sd > 0.0, sd, 1.0)  # units do not spoil the inverse
    shape = np.linalg.pinv(np.atleast_2d(np.cov(scaled, rowvar=False)))
    return first_least(cdist(scaled, scaled, "mahalanobis", VI=shape).sum(axis=1))


def _criticism(config, whole, measured, draws):
    """Pull of each target, whether all agree, and whether the model gives such values at all."""
    seed = config.seed
    cloud = Cloud.of(whole, seed=seed)
    read = {target.name: target for target in measured}
    return {
        "targets": [
            {"rig": read[p["response"]].test, "metric": read[p["response"]].metric}
            | p
            | {"agrees": p["p_others"] >= critique.ALPHA}
            for p in critique.pulls(cloud, draws, seed)
        ],
        "agreement": critique.agreement(cloud, draws, seed),
        "misspecification_p": critique.misspecification(whole, seed=seed),
    }


def _parameters(factors, experiment, posterior, prior):
    """Mean, standard deviation, interval of each parameter; the share of its prior's standard
    deviation that is left; whether the measurements bound it; the side of its region on which it
    presses, and the level that the region would have to reach, or the last that is possible. An
    interval that is not bounded on a side ends there where the region ends."""
    low, high = posterior.interval(LEVEL)
    low, high = np.where(low > INSIDE, low, 0.0), np.where(high < 1.0 - INSIDE, high, 1.0)
    before = prior.draw(PRIOR_DRAWS, np.random.default_rng(1)).std(axis=0)
    pressed, found = critique.borders(posterior.draws, prior), {}
    for k, f in enumerate(factors):
        u = posterior.draws[:, k]
        own = pressed.get(k)
        found[f.name] = {
            "mean": f.natural(float(2.0 * u.mean() - 1.0)),
            "sd": float(2.0 * u.std(ddof=1) * f.half_range),
            "interval": [f.natural(float(2.0 * x - 1.0)) for x in (low[k], high[k])],
            "left": float(u.std(ddof=1) / before[k]),
            "bounded": bool(low[k] > 0.0 and high[k] < 1.0),
            "border": own[0] if own else None,
            **_reach(f, experiment, own),
        }
    return found


def _reach(factor, experiment, border):
    """Level beyond the border at which the draws would have fallen off, None without a border, and
    whether the last possible level comes before."""
    if border is None:
        return {"reach": None, "reach_is_limit": False}
    side, beyond = border[0], border[1] * (factor.high - factor.low)
    level = factor.low - beyond if side == "low" else factor.high + beyond
    possible = float(np.clip(level, *physical_range(factor.key, experiment)))
    return {"reach": possible, "reach_is_limit": possible != level}


def _as_table(parameters):
    table = pd.DataFrame(
        {"parameter": name, "low": p["interval"][0], "high": p["interval"][1]} | p
        for name, p in parameters.items()
    )
    return table[["parameter", *"mean sd left low high bounded border reach".split()]]


def _targets(whole, apart):
    """A row a target: what was measured, its error, what is predicted, pull and p by all targets
    and by all others."""
    table = pd.DataFrame(apart).assign(error=np.sqrt([r.variance for r in whole.responses]))
    shown = "rig metric measured error predicted sd pull p pull_others p_others"
    return table.reindex(columns=shown.split())


def _without_value(emulators, measured):
    """{target: runs of its rig that gave no value}."""
    values = {t.name: emulators.values(t.test, t.metric) for t in measured}
    return {name: int((~np.isfinite(own)).sum()) for name, own in values.items()}


HOURS = Path(__file__).with_name("laboratory_hours.csv")
LEVEL = 0.95


def next_tests(
    config: Config,
    emulators: Emulators,
    measured: Mapping[JointTarget, MeasuredMean],
    tests: Mapping[str, Sequence[str]],
    draws: np.ndarray,
    machine: str | None = None,
) -> pd.DataFrame:
    """Return what each metric of each test is expected to tell an hour, the best first; of the
    metrics of `machine` where it is named. tests: {test: metrics}; draws: u (k, d) of the
    posterior. Raises ConfigError for a table of hours that cannot be read."""
    spread = {(t.test, t.metric): mean.reading_sd for t, mean in measured.items()}
    wanted, candidates = None, []
    for rig, metrics in tests.items():
        known = _known(emulators, rig, metrics)
        if rig == machine:
            wanted = next(iter(known.values()), None)
            continue
        hours, readings = hours_of(config, rig), config.posterior.readings
        candidates += [
            Candidate(rig, metric, emulator, readings, hours, spread.get((rig, metric), 0.0))
            for metric, emulator in known.items()
        ]
    told = rank(candidates, draws, wanted, config.seed)
    return pd.DataFrame([_row(t, emulators.factors, spread) for t in told])


def _known(emulators, rig, metrics):
    """{metric: emulator} of those metrics that the rig's runs tell."""
    found = {}
    for metric in metrics:
        try:
            found[metric] = emulators.of(rig, metric)
        except CalibrationError:
            continue  # it does not vary, or few runs give it
    return found


def metrics_of(
    config: Config, rig: str, measured: Mapping[JointTarget, MeasuredMean]
) -> Sequence[str]:
    """Metrics of a rig that are predicted and could be measured: those that its `metrics` name,
    else its experiment's main one and those that were measured."""
    own = config.tests[rig]
    main = experiments()[own.experiment].targets[:1]
    found = [t.metric for t in measured if t.test == rig]
    return tuple(dict.fromkeys(own.metrics or (*main, *found)))


def hours_of(config: Config, rig: str) -> float:
    """Hours that a rig's readings take: the study's own, else the table's by its experiment.
    Raises ConfigError."""
    if rig in config.posterior.hours:
        return float(config.posterior.hours[rig])
    table = read_table(HOURS)
    rows = {row["experiment"]: (line, row["hours"]) for line, row in table.rows}
    line, hours = rows[config.tests[rig].experiment]
    return float(table.number(line, "hours", hours))


def _row(told, factors, measured):
    c = told.candidate
    row = {"rig": c.rig, "metric": c.metric, "measured": (c.rig, c.metric) in measured}
    row |= {"hours": c.hours, "nat": told.nat, "nat_per_hour": told.nat_per_hour}
    row |= {"low": told.low, "high": told.high, "error": told.error}
    row |= {f"{f.name} left": float(x) for f, x in zip(factors, told.left, strict=True)}
    if told.prediction_left is not None:
        row["prediction left"] = told.prediction_left
    return row


def predictions(
    config: Config, emulators: Emulators, tests: Mapping[str, Sequence[str]], draws: np.ndarray
) -> pd.DataFrame:
    """Return what the posterior expects of each metric of each test, and which parameter it owes
    its spread, over those draws at which the test gives a value, and one that is possible; nan
    where these are not more than half. tests: {test: metrics}; draws: u (k, d)."""
    return pd.DataFrame(
        {"rig": rig, "metric": metric} | _prediction(config, emulators, rig, metric, draws)
        for rig, metrics in tests.items() for metric in _known(emulators, rig, metrics)
    )  # fmt: skip


def _prediction(config, emulators, rig, metric, draws):
    emulator, names = emulators.of(rig, metric), [f.name for f in emulators.factors]
    u, many, run = pushed(emulator, draws, config.seed)
    metrics = experiments()[config.tests[rig].experiment].metrics
    least, most = next((m.least, m.most) for m in metrics if m.name == metric)
    has = (many >= least) & (many <= most)
    if formed := emulators.formed(rig, metric, 1):
        chances = np.random.default_rng([config.seed, 1]).random(len(u))
        has &= chances < np.exp(formed.log_likelihood(u))
    expected = emulator.mean(u)[0]
    values = expected, many, run.clip(least, most)
    mean, many, run = (x[has] if has.mean() > 0.5 else np.nan * x for x in values)
    row = {"mean": float(mean.mean()), "sd_parameters": float(mean.std())}
    for name, values in (("", many), ("run_", run)):
        row[f"{name}low"], row[f"{name}high"] = tails(values)
    for told, own in zip(("share", "alone"), shares(expected, u), strict=True):
        row |= {f"{name} {told}": float(x) for name, x in zip(names, own, strict=True)}
    return row


def tails(values: np.ndarray, level: float = LEVEL) -> list[float]:
    """Ends of a level's interval of values (k,)."""
    tail = 0.5 * (1.0 - level)
    return [float(x) for x in np.quantile(values, [tail, 1.0 - tail])]
