"""The parameters as a distribution: of one test from the chain's runs, of all tests from runs of
their own.

The runs of the joint posterior are one design for all tests, over the whole levels of all factors,
and points that are added where the posterior is wide. The computing is `calibration.chain.joint`'s,
which loads what samples a posterior: the functions here import it when they are called.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from calibration import figures
from calibration.chain.study import NamedFiles, Study, read_region
from calibration.errors import CalibrationError
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import together, write_plan
from calibration.stages import worded
from calibration.statistics.design import space_filling
from calibration.statistics.factor import Factor
from calibration.statistics.numbers import fixed
from calibration.statistics.ties import first_least
from calibration.study.config import METRICS, Config
from calibration.study.config.joint import (
    joint_factors,
    joint_targets,
    joint_tests,
    measured_of,
    own_targets,
    refined_tests,
)
from calibration.study.simulated_tests import simulated
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.experiments import experiments
from dem.io.files import write_json


def plan_joint_first(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan one space-filling design over the free factors (scrambled Sobol points) for every rig,
    the first `joint.repeated` points twice where runs of the rig scatter. By the atlas `joint.runs`
    points of a test that it has are spread over what it makes of the measured tests; what runs of
    others say far from there, nothing else would."""
    config, factors, parts = study.config, free_factors(study), []
    tests, spread = _by_atlas(config, factors) if config.by_atlas else ((), None)
    for rig in joint_tests(config):
        points = spread if rig in tests else first_points(config, rig, len(factors))
        parts.append(_planned(study, rig, factors, points, 0))
    write_plan(output.plan, *_numbered(parts))


def _by_atlas(config, factors):
    """(tests that the atlas has, points (n, d) where it expects the answer); no tests where it has
    nothing of what was measured."""
    from calibration.atlas.emulators import AtlasEmulators
    from calibration.chain.joint.analysis import joint_of

    atlas = AtlasEmulators(config, factors)
    if not any(atlas.has(t.test, t.metric) for t in joint_targets(config)):
        return (), None
    draws = joint_of(config, atlas, atlas.told()[0]).posterior(config.seed).draws  # type: ignore[arg-type]  # as Emulators
    return atlas.tests, _spread(draws, config.joint.runs, config.seed)


def _emulators(config, factors, design):
    """Emulators of a design's runs; by the atlas they correct it."""
    from calibration.atlas.emulators import AtlasEmulators
    from calibration.chain.joint.analysis import Emulators

    return Emulators(factors, design, AtlasEmulators(config, factors) if config.by_atlas else None)


def plan_joint(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The design of all runs, and the plan of those that are added: `joint.second_wave` points
    spread over the posterior that the first runs, finished by now, give. They are for the rigs of
    the targets that these do not tell yet, and for `joint.machine`."""
    config, factors = study.config, free_factors(study)
    first, parts = read_written(source.first), []
    if config.joint.second_wave:
        from calibration.chain.joint.analysis import joint_of

        measured = measured_of(config, joint_targets(config))
        emulators = _emulators(config, factors, first)
        draws = joint_of(config, emulators, measured).posterior(config.seed).draws
        points = _spread(draws, config.joint.second_wave, config.seed)
        before = config.joint.runs + config.joint.repeated
        for rig in refined_tests(config):
            if not _told(emulators, measured, rig, draws):
                parts.append(_planned(study, rig, factors, points, before))
    parts = [(first.drop(columns="run"), {}), *parts]
    table, specs = _numbered(parts)
    write_plan(output.plan, table, specs, first["run_id"])


TOLD = 0.5
"""Of the error of a measured mean. An emulator that is known so well adds an eighth to it at most,
and further runs narrow nothing."""


def _told(emulators, measured, rig, draws):
    """Whether the runs of a rig tell all that was measured of it, where the posterior stands."""
    own = [(emulators.of(rig, t.metric), mean) for t, mean in measured.items() if t.test == rig]
    return bool(own) and all(
        emulator.mean(draws)[1].mean() <= TOLD**2 * mean.variance for emulator, mean in own
    )


def free_factors(study: Study) -> list:
    """Factors of a study that its targets are to tell. Raises CalibrationError where none is
    free."""
    factors = joint_factors(study.config, study.factors)
    if not factors:
        raise CalibrationError("no factor is free: joint.factors names none whose levels differ")
    return factors


def first_points(config: Config, rig: str, d: int) -> np.ndarray:
    """Return the points (n, d) in [0, 1] of the first runs of a rig, for d free factors."""
    points = space_filling(config.joint.runs, d, config.seed)
    scatters = experiments()[config.tests[rig].experiment].poured
    return np.concatenate([points, points[: config.joint.repeated if scatters else 0]])


def _planned(study, rig, factors, u, before):
    """Table and specs of the runs of a rig at u (n, d), each with a seed of its own: one seed for
    all would shift all of them alike, and no repeated point would show it. before: seeds that the
    rig's other runs have."""
    config, test = study.config, simulated(study.config, rig)
    levels = {f.name: np.round(f.natural(2.0 * u[:, k] - 1.0), 9) for k, f in enumerate(factors)}
    design = pd.DataFrame({"rig": rig} | levels)
    parts = [
        study.plan_test(design.iloc[[n]], test, config.seed + before + n)
        for n in range(len(design))
    ]
    return together(parts)


def _numbered(parts):
    """Tables and specs as one of each, a row a run."""
    table, specs = together(parts)
    table = table.drop_duplicates("run_id", ignore_index=True)
    return table.assign(run=np.arange(1, len(table) + 1)), specs


def _spread(draws, count, seed):
    """Points (count, d) spread over draws (k, d): the nearest draw to each centre of clusters."""
    from sklearn.cluster import KMeans

    from calibration.inference.joint.critique import thinned

    some = thinned(draws)
    centres = KMeans(min(count, len(some)), n_init=1, random_state=seed).fit(some).cluster_centers_
    apart = ((centres[:, None] - some[None]) ** 2).sum(axis=2)
    return some[np.unique([first_least(row) for row in apart])]  # a pair is as near to its centre


def _first(config, factors):
    """The common design of each test and what is repeated of it, where the study waits for them."""
    waits = joint_tests(config) if "joint" in config.supplements else ()
    d = len(joint_factors(config, factors))
    return [_points(config, name, len(first_points(config, name, d))) for name in waits]


def _second(config, factors):
    """Runs that are added where the posterior is wide, at most, where the study waits for them."""
    waits = refined_tests(config) if "joint" in config.supplements else ()
    return [_points(config, name, config.joint.second_wave) for name in waits]


def _points(config, name, count):
    run, experiment = config.run_of(name), config.tests[name].experiment
    return Points(f"tests.{name}", pd.DataFrame(index=range(count)), experiment, run)


TRAINED_WITHIN = 1.5
"""Coded distance from the region's centre of the chain's runs that train: a process learns a region
better than its outskirts."""


def joint(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The posterior of all tests, from runs over the whole levels. Writes the outputs that the rule
    declares."""
    from calibration.chain.joint.analysis import metrics_of

    config, factors = study.config, free_factors(study)
    measured = measured_of(config, joint_targets(config))
    tests = {name: metrics_of(config, name, measured) for name in joint_tests(config)}
    emulators = _emulators(config, factors, read_written(source.design))
    _write(config, emulators, measured, tests, output, config.joint.machine)


def posterior(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """The posterior of the chain's one test, from its own runs in the region and near it.

    source.designs: designs of finished runs (the ascent's, the surface's, the candidate's, the
    validation's). Writes the outputs that the rule declares."""
    from calibration.chain.joint.analysis import Emulators

    config, region = study.config, read_region(source.optimum)
    metrics = config.tests[config.own].metrics or METRICS[config.experiment]
    emulators = Emulators(region, _near(config.own, region, source.designs))
    measured = measured_of(config, own_targets(config))
    _write(config, emulators, measured, {config.own: metrics}, output)


def _write(config, emulators, measured, tests, output, machine=None):
    from calibration.chain.joint.analysis import analysed

    summary, tables = analysed(config, emulators, measured, tests, machine)
    if emulators.atlas:
        summary["atlas"] = emulators.atlas.said(measured)
    write_posterior(emulators.factors, summary, tables, output)


def write_posterior(
    factors: Sequence[Factor],
    found: Mapping[str, Any],
    tables: Mapping[str, pd.DataFrame],
    output: NamedFiles,
) -> None:
    """Write what `calibration.chain.joint.analysis.analysed` gives: a file a table, the figure
    `pairs` where there are draws, the summary."""
    for name, table in tables.items():
        write_table(table, getattr(output, name))
    if "draws" in tables:
        draws, told = tables["draws"], found["parameters"]
        figures.save(posterior_pairs(factors, draws, told, dict(draws.iloc[0])), output.pairs)
    write_json(output.summary, found)


def _near(name, region, designs):
    """Runs of all designs that hold the region's factors near it, each once, as those of a test."""
    names = [f.name for f in region]
    tables = [t for t in map(read_written, designs) if set(names) <= set(t)]
    runs = pd.concat([t[[*names, "run_id"]] for t in tables], ignore_index=True)
    runs = runs.drop_duplicates("run_id").assign(rig=name)
    near = np.all([np.abs(f.coded(runs[f.name])) <= TRAINED_WITHIN for f in region], axis=0)
    return runs[near]


BINS = 24
MARKS = 200  # draws that a pair shows; each is a mark of its own in the page


def posterior_pairs(
    region: Sequence[Factor],
    draws: pd.DataFrame,
    parameters: Mapping[str, Mapping[str, Any]],
    middle: Mapping[str, float],
) -> figures.Drawing:
    """Each parameter's distribution with its interval on the diagonal, each pair below it.

    region: `Factor`s; draws: table of natural levels; parameters: {name: {interval}}; middle:
    {name: natural level} of a set that stands for all. The frame is the prior's box.
    """
    d = len(region)
    with figures.styled() as plt:
        size = 2.6 * max(d, 1.6)
        figure, axes = plt.subplots(
            d, d, figsize=(size, 0.92 * size), layout="constrained", squeeze=False
        )
    for i, row in enumerate(region):
        for j, column in enumerate(region):
            ax = axes[i, j]
            if j > i:
                ax.set_axis_off()
                continue
            if i == j:
                _marginal(ax, row, draws[row.name], parameters[row.name], middle)
            else:
                _pair(ax, row, column, draws, middle)
            ax.set_xlim(column.low, column.high)
            ax.set_xlabel(figures.label(column.name) if i == d - 1 else "", fontsize=8)
            ax.set_ylabel(figures.label(row.name) if j == 0 and i else "", fontsize=8)
            ax.tick_params(labelsize=7)
            ax.locator_params(axis="x", nbins=4)  # long numbers of a narrow range
    return figure


def _marginal(ax, factor, levels, found, middle):
    ax.hist(
        levels, BINS, range=(factor.low, factor.high), density=True, color=figures.BLUE, alpha=0.55
    )
    ax.axhline(1.0 / (factor.high - factor.low), color=figures.GREY, lw=1, ls=":")
    ax.axvspan(*found["interval"], color=figures.BLUE, alpha=0.12, lw=0)
    ax.axvline(middle[factor.name], color=figures.ORANGE, lw=1.5)
    ax.set_yticks([])


def _pair(ax, row, column, draws, middle):
    x, y = draws[column.name], draws[row.name]
    some = np.linspace(0, len(x) - 1, min(MARKS, len(x))).astype(int)
    ax.scatter(x.iloc[some], y.iloc[some], s=6, color=figures.BLUE, alpha=0.45, lw=0)
    ax.plot(
        middle[column.name], middle[row.name], "o", color="white", mec=figures.ORANGE, mew=2, ms=7
    )
    ax.set_ylim(row.low, row.high)
    ax.set_title(f"correlation {fixed(np.corrcoef(x, y)[0, 1], 2, '+')}", fontsize=7)


TOGETHER = 0.4  # correlation from which on two parameters are said to go together
TELLS = 0.9  # of today's standard deviation: a measurement that leaves more tells little


def kinds(summary: Mapping[str, Any]) -> dict[str, list[str]]:
    """{kind: parameters} of a mapping of joint.json: bounded by the targets, narrowed by them,
    known beforehand and no better, open, and those that press on a border of the region."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for name, p in summary["parameters"].items():
        told = "bounded" if p["bounded"] else "narrowed"
        untold = "known" if name in summary.get("priors", {}) else "open"
        kind = told if p["left"] <= TELLS else untold
        found["border" if p["border"] else kind].append(name)
    return found


def tells_most(summary: Mapping[str, Any]) -> tuple[dict[str, Any], str, float]:
    """(the best next test of a mapping of joint.json, the parameter that it tells most of, the
    share of its spread that it leaves)."""
    best = summary["next_test"][0]
    left = {k.removesuffix(" left"): v for k, v in best.items() if k.endswith(" left")}
    return best, *min(left.items(), key=lambda pair: pair[1])


def _correlated(summary):
    """[(parameter, another, their correlation)] of those that hang together."""
    names, rows = list(summary["parameters"]), summary["correlation"]
    pairs = [(i, j) for i in range(len(names)) for j in range(i)]
    return [(names[i], names[j], rows[i][j]) for i, j in pairs if abs(rows[i][j]) >= TOGETHER]


sentences = worded(
    "joint", kinds=kinds, correlated=_correlated, tells_most=tells_most, little=TELLS
)
atlas_against = worded("atlas_against")
against = worded("against")
"""What of the targets of a mapping of joint.json speaks against the model: a contradiction between
them, and each one of which all others expect another value."""


SHOWN: Any = {
    "figures": (Figure("pairs", ("draws.csv", "parameters.csv")),),
    "tables": (
        ("parameters", "Parameters with their 95 % intervals"),
        ("targets", "Targets beside what the others expect; pull: the difference in sd"),
        ("next", "What each further test tells; one nat leaves 37 % of what is open"),
        ("predictions", "What is expected of each test, and from which parameter"),
    ),
    "sentences": sentences,
}
"""What either posterior shows."""


STAGES = (
    Stage(name="posterior", title="The parameters as a distribution", place=5.1, **SHOWN),
    Stage(
        name="joint",
        title="All tests together",
        place=5.3,
        # the second plan has the runs that the first ones ask for
        plans=(
            Plan("joint_first", ahead=_first),
            Plan("joint", ahead=_second),
        ),
        **SHOWN,
    ),
)
