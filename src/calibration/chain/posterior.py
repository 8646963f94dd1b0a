"""Posterior: the parameters as a distribution, from all runs of the chain near the optimum and the
measured values."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain.files import read_region
from calibration.chain.responses import columns, with_responses
from calibration.errors import CalibrationError
from calibration.files import read_json, write_table
from calibration.inference.chance_of_no_value import Chance
from calibration.inference.information import expected_information, expected_spread
from calibration.inference.posterior_sampling import (
    Formed,
    Measured,
    Prior,
    sample,
    sobol_indices,
)
from calibration.inference.scatter_emulator import ScatterEmulator
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values, reason_without
from calibration.study.config import is_measured, read_target
from dem.experiments import experiments
from dem.io.files import write_json

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study


TRAINED_WITHIN = 1.5
"""Coded distance from the region's centre of the runs that train: a process learns a region better
than its outskirts."""
LEVEL = 0.95


def posterior(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Sample the posterior over the region's box, and say which factors matter there and what to
    measure next.

    source.designs: designs of finished runs (the ascent's, the surface's, the candidate's, the
    validation's), each with `run_id` and the factors' natural levels. Writes the outputs that the
    stage declares. Raises CalibrationError where too few runs have a response.
    """
    config = study.config
    region = read_region(source.optimum)
    runs = _runs(config, region, source.designs)
    u = _unit(region, runs)
    targets = [config.target, *(t for t in config.further_targets if is_measured(config, t))]
    measured = [_measured(config, target, runs, u) for target in targets]
    posterior = sample([*measured, *_formed(config, runs, u)], _prior(config, region), config.seed)
    thinned = np.linspace(0, len(posterior.draws) - 1, _kept(config, posterior)).astype(int)
    kept, main = posterior.draws[thinned], measured[0]
    forward = _pushed(main, kept, config.seed)
    draws = _natural(region, kept).assign(predicted=forward["mean"])
    parameters = _parameters(region, posterior)
    following = _next_measurements(config, region, runs, u, kept, main)
    write_table(draws, output.draws)
    write_table(_as_table(parameters), output.parameters)
    write_table(following, output.next)
    optimum = read_json(source.optimum)["optimum"]
    _draw(config, region, draws, parameters, optimum, forward, following, output)
    names = [f.name for f in region]
    write_json(
        output.summary,
        {
            "parameters": parameters,
            "correlation": np.corrcoef(posterior.draws.T).reshape(len(region), -1).tolist(),
            "level": LEVEL,
            "box": {f.name: [f.low, f.high] for f in region},
            "targets": {
                t.metric: {"mean": m.mean, "standard_error": m.se, "discrepancy": m.discrepancy}
                for t, m in zip(targets, measured, strict=True)
            },
            "pushed_forward": {name: _interval(v) for name, v in forward.items()},
            "trained_by": int(runs["response"].notna().sum()),
            "without_value": _without_value(runs),
            "seed_sd": float(main.emulator.scatter(kept).mean()),
            "sobol": sobol_indices(lambda x: main.emulator.mean(x)[0], names, config.seed),
            "sampler": {
                "draws": len(posterior.draws),
                "effective": posterior.effective,
                "autocorrelation": posterior.autocorrelation,
                "accepted": posterior.accepted,
                "converged": posterior.converged,
            },
            "readings": config.posterior.readings,
            "grains": config.own_run.get("particles", {}).get("count"),
            "next_experiment": following.to_dict("records"),
        },
    )


def _kept(config, posterior):
    return min(config.posterior.draws, len(posterior.draws))


def _runs(config, region, design_files):
    """Runs of all designs that hold the region's factors near it, each once; one that gave no value
    has no response."""
    names = [f.name for f in region]
    tables = [with_responses(d, config) for d in map(read_written, design_files) if len(d)]
    wanted = [*names, "run_id", *columns(config)]
    runs = pd.concat([t[wanted] for t in tables if set(names) <= set(t)], ignore_index=True)
    runs = runs.drop_duplicates("run_id")
    near = np.all([np.abs(f.coded(runs[f.name])) <= TRAINED_WITHIN for f in region], axis=0)
    return runs[near].reset_index(drop=True)


def _unit(region, runs):
    """Levels (n, d) in units of the box: 0 at low, 1 at high."""
    return np.column_stack([0.5 + 0.5 * f.coded(runs[f.name].to_numpy(float)) for f in region])


def _natural(region, u):
    return pd.DataFrame({f.name: f.natural(2.0 * u[:, k] - 1.0) for k, f in enumerate(region)})


def _measured(config, target, runs, u):
    """A target's mean with its standard error, and the emulator of its response."""
    values = read_target(config, target)
    column = "response" if target.metric == config.target.metric else target.metric
    has = runs[column].notna().to_numpy()
    emulator = ScatterEmulator(u[has], runs.loc[has, column].to_numpy(float))
    error = float(values.std(ddof=1) / np.sqrt(len(values)))
    discrepancy = config.tests[config.own].discrepancy.get(target.metric, 0.0)
    return Measured(emulator, float(values.mean()), error, discrepancy)


def _formed(config, runs, u):
    """What the laboratory's tests say that all gave a value: nothing where no run lacks one."""
    failed = runs["response"].isna().to_numpy()
    if not failed.any():
        return []
    tests = len(read_target(config, config.target))
    return [Formed(Chance(u, failed, np.ones(len(runs))), tests)]


def _without_value(runs):
    names = runs.loc[runs["response"].isna(), "run_id"]
    return [{"run": name, "reason": reason_without(name)} for name in names]


def _prior(config, region):
    """Uniform over the box, or normal where the configuration says so."""
    known = config.posterior.priors
    stray = sorted(set(known) - {f.name for f in region})
    if stray:
        raise CalibrationError(
            f"posterior.priors: {', '.join(stray)}: no factor of the region; "
            f"known: {', '.join(f.name for f in region)}"
        )
    mean, sd = np.full(len(region), 0.5), np.full(len(region), np.inf)
    for k, f in enumerate(region):
        if f.name in known:
            mean[k] = 0.5 + 0.5 * f.coded(known[f.name].mean)
            sd[k] = 0.5 * known[f.name].sd / f.half_range
    return Prior(mean, sd)


def _pushed(main, u, seed):
    """{mean, run}: (n,) values of the target that the draws u (n, d) expect of many runs, with the
    emulator's error, and of a single one."""
    rng = np.random.default_rng(seed)
    mean, variance = main.emulator.mean(u)
    many = rng.normal(mean, np.sqrt(variance))
    return {"mean": many, "run": rng.normal(many, main.emulator.scatter(u))}


def _interval(values):
    tail = 0.5 * (1.0 - LEVEL)
    return [float(x) for x in np.quantile(values, [tail, 1.0 - tail])]


def _parameters(region, posterior):
    """Mean, standard deviation and central interval of every parameter, and whether the box cuts
    it."""
    low, high = posterior.interval(LEVEL)
    found = {}
    for k, f in enumerate(region):
        u = posterior.draws[:, k]
        found[f.name] = {
            "mean": f.natural(float(2.0 * u.mean() - 1.0)),
            "sd": float(2.0 * u.std(ddof=1) * f.half_range),
            "interval": [f.natural(float(2.0 * x - 1.0)) for x in (low[k], high[k])],
            # a flat marginal has its 95 % interval from 0.025 to 0.975 of the box
            "bounded": bool(low[k] > 0.05 and high[k] < 0.95),
        }
    return found


def _as_table(parameters):
    rows = [
        {"parameter": name, "mean": p["mean"], "sd": p["sd"]}
        | {"low": p["interval"][0], "high": p["interval"][1], "bounded": p["bounded"]}
        for name, p in parameters.items()
    ]
    return pd.DataFrame(rows)


def _next_measurements(config, region, runs, u, draws, main):
    """What each further measurement is expected to tell, best first: of the metrics that these runs
    gave already, and of as many more readings of the target as `posterior.readings`.

    Columns: metric, meaning, measured (whether it is a target), low and high that the draws expect
    of its mean, error of the mean of so many readings, nat, and `<parameter> left`: standard
    deviation that is expected to remain, over that of today.
    """
    used, found = columns(config).values(), []
    for metric in experiments()[config.experiment].metrics:
        if not metric.target:
            continue
        emulator = main.emulator
        if metric.name != config.target.metric:
            values = read_values(runs["run_id"], metric.name)
            has = np.isfinite(values)
            try:
                emulator = ScatterEmulator(u[has], values[has])
            except CalibrationError:
                continue  # it does not vary here, so it tells nothing
        told = _told(region, emulator, draws, config)
        row = {"metric": metric.name, "meaning": metric.meaning}
        found.append(row | {"measured": metric.name in used} | told)
    return pd.DataFrame(found).sort_values("nat", ascending=False, ignore_index=True)


def _told(region, emulator, draws, config):
    """What the mean of so many readings that scatter as runs do is expected to tell, by an emulator
    that is itself in error."""
    mean, variance = emulator.mean(draws)
    error = np.sqrt(variance + emulator.scatter(draws) ** 2 / config.posterior.readings)
    left = expected_spread(mean, error, draws, config.seed) / draws.std(axis=0)
    low, high = _interval(mean)
    return {
        "low": low,
        "high": high,
        "error": float(np.sqrt(np.mean(error**2))),
        "nat": expected_information(mean, error),
    } | {f"{f.name} left": float(min(x, 1.0)) for f, x in zip(region, left, strict=True)}


def _draw(config, region, draws, parameters, optimum, forward, following, output):
    response = figures.response_of(config.target.metric)
    measured = read_target(config, config.target)
    figures.save(figures.posterior_pairs(region, draws, parameters, optimum), output.pairs)
    drawn = figures.pushed_forward(forward["mean"], forward["run"], measured, response)
    figures.save(drawn, output.pushed)
    figures.save(figures.next_measurements(following), output.following)
