"""The scaling claim of 1.2: a heap and a drop enlarged by a rule, grain and rig alike, and what the
paper says of them judged by these runs. What follows from the dimensions alone its audit judges.

The unit in the name of a run spec's key says which quantity it is, so one table turns a rule into a
run spec. Gravity is the Earth's in every run: a rule that would have it scaled is tried as the
paper applies it, with everything else scaled. The number of grains is the same at every scale.

A quantity that a rule keeps has the same value at every scale. A value is kept if the 95 % interval
of its change over the scales lies within the margin that does not matter. It is changed if the
interval leaves out zero and part of it lies beyond the margin. Otherwise it is undecided.
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike

from calibration import figures
from calibration.chain.study import NamedFiles, Study
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_metric, read_values, together, write_plan
from calibration.stages import worded
from calibration.statistics import dimensions
from calibration.statistics.dimensions import PAPER, PAPER_RULE
from calibration.statistics.numbers import fixed
from calibration.study.config import Config, given, overlay, point_spec
from calibration.study.stage import Figure, Plan, Points, Stage
from dem.contact.catalogue import LAWS
from dem.grains.sizes import mean_radius
from dem.io.files import write_json
from dem.spec import keys_of, parse_spec
from dem.units import in_ascii, unit_of

EXPERIMENTS = ("heap", "drop")
DROPS = 2  # at each scale
COHESION = set().union(*map(keys_of, LAWS["cohesion"].values()))
NOT_SCALED = ("output", "seed")  # what is written, not what is simulated


def enlarged(
    run: Mapping[str, Any], experiment: str, rule: Mapping[str, float], h: float
) -> dict[str, Any]:
    """The run spec `run` (a mapping without experiment and seed), defaults put in, enlarged h times
    by `rule`.

    Raises ScalingError for a mesh, which has no key to scale, and for a law as a curve; SpecError
    as `dem.spec.parse_spec` does.
    """
    spec = parse_spec(point_spec(run, experiment, {}, 1)).model_dump(mode="json")
    factor = dimensions.factors(rule, h)
    return {
        section: value if section in NOT_SCALED else _scaled(value, factor)
        for section, value in spec.items()
        if section not in ("experiment", "seed")
    }


def _scaled(part, factor, key=""):
    if isinstance(part, dict):
        return {k: _scaled(v, factor, k) for k, v in part.items()}
    if key.endswith("_stl") and part is not None:
        raise dimensions.ScalingError(
            f"{key}: a mesh cannot be enlarged here; use the analytic rig"
        )
    if key.endswith("_curve_low") and part is not None:
        raise dimensions.ScalingError(
            f"{key}: the states of a curve, whose unit its powers make, cannot be enlarged here; "
            "use a law with a constant coefficient"
        )
    quantity = dimensions.HELD_IN.get(unit_of(key))  # type: ignore[arg-type]
    if quantity is None or part is None:
        return part
    if isinstance(part, list):
        return [round_off(x * factor[quantity]) for x in part]
    return round_off(part * factor[quantity])


def round_off(value: float) -> float:
    """Nine significant digits: the last bits of a power would rename a cached run."""
    return float(f"{value:.9g}")


def base_run(config: Config, experiment: str, cohesive: bool) -> dict[str, Any]:
    """The run spec at scale 1, without experiment and seed; the study's own cohesion is left out of
    it."""
    section = config.scaling
    run = overlay(config.run, getattr(section, experiment))
    laws = run.get("laws", {}) | {"cohesion": "none"}
    constants = {k: v for k, v in run.get("law_parameters", {}).items() if k not in COHESION}
    run |= {"laws": laws, "law_parameters": constants}
    return overlay(run, section.cohesion) if cohesive else run  # type: ignore[union-attr]  # the stage has its section


def plan_scaling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan every experiment under every rule and scale, without and with cohesion, with all
    seeds."""
    given(study.config, "scaling", "scaling")
    parts = []
    for case, rule, h in _cases(study.config):
        run = enlarged(case.run, case.experiment, dimensions.RULES[rule], h)
        parts.append(study.plan(case.design, case.experiment, run))
    write_plan(output.plan, *together(parts))


def _cases(config):
    """(`Points` at scale 1, rule, scale) of each case that is run; none of a study that does not
    ask for them."""
    section = config.scaling
    if section is None:
        return
    for kind, rule, cohesive, h in product(
        EXPERIMENTS, dimensions.RULES, (False, True), section.factors
    ):
        rows = pd.DataFrame([section.point] * (section.seeds if kind == "heap" else DROPS))
        rows = rows.assign(rule=rule, cohesive=cohesive, scale=h)
        run = base_run(config, kind, cohesive)
        yield Points(f"scaling.{kind}", rows, kind, run), rule, h


OVERLAP = 0.01  # of the radius
STRETCH = 1e-3  # of the overlap: the step of the stiffness
SPEED = 1e-3  # of the overlap over the Rayleigh time step: small beside the elastic force


def probe(run: dict[str, Any]) -> dict[str, float]:
    """Return force [N], stiffness [N/m] and damping coefficient [kg/s] of a grain that is pressed
    into a plate by a fixed share of its radius, at rest and with a small speed. The paper's Eqs. 6
    and 15 state how they go with the scale.

    `run` is a run spec of the drop, without experiment and seed.
    """
    spec = parse_spec(run | {"experiment": "drop", "numerics": {"precision": "double"}})
    radius = mean_radius(spec)
    force, step = _force(spec, radius, OVERLAP * radius, 0.0)
    more = _force(spec, radius, OVERLAP * radius * (1.0 + STRETCH), 0.0)[0]
    speed = SPEED * OVERLAP * radius / step
    moving = _force(spec, radius, OVERLAP * radius, speed)[0]
    return {
        "force": force,
        "stiffness": (more - force) / (STRETCH * OVERLAP * radius),
        "damping_coefficient": (moving - force) / speed,
    }


def _force(spec, radius, overlap, speed):
    """Force on the plate [N] and the time step [s]; speed of approach [m/s]."""
    from dem.experiments.setup import build_simulation  # loads the engine
    from dem.materials import WALL
    from dem.walls.builder import WallSet

    walls = WallSet().body("plate", material=WALL).plane((0, 0, 0), (0, 0, 1))
    sim = build_simulation(spec, walls, gravity=(0.0, 0.0, 0.0))
    sim.add_particles([[0.0, 0.0, radius - overlap]], radius, velocity=[[0.0, 0.0, -speed]])
    sim.advance(1)
    return abs(float(sim.wall_force("plate")[2])), sim.time_step


def measured_exponents(runs: Mapping[float, dict[str, Any]]) -> dict[str, float]:
    """{quantity: exponent of h} over {h: run spec}, by a straight line through the logarithms."""
    found = {h: probe(run) for h, run in runs.items()}
    scale = np.log(list(found))
    return {
        quantity: float(np.polyfit(scale, np.log([f[quantity] for f in found.values()]), 1)[0])
        for quantity in next(iter(found.values()))
    }


RESPONSE = {"heap": "angle_of_repose_deg", "drop": "effective_restitution"}
HOLDS, FAILS, UNDECIDED = "holds", "fails", "undecided"
KEPT, CHANGED = "kept", "changed"
VERDICT = {KEPT: HOLDS, CHANGED: FAILS, UNDECIDED: UNDECIDED}
FOUND = ("found", "low", "high")
ALPHA = 0.05
EXACT = 0.01  # exponents measured on one contact carry rounding alone


def response_table(runs: pd.DataFrame) -> pd.DataFrame:
    """Table, a row a case and scale: mean, sd, interval. n counts the runs with a value; what fewer
    than two tell is NaN.

    runs : columns experiment, rule, cohesive, scale, left_in_funnel (grains, heaps only),
        response, NaN of a run without a value
    """
    rows = []
    for (experiment, rule, cohesive, scale), group in runs.groupby(
        ["experiment", "rule", "cohesive", "scale"], sort=False
    ):
        values = group["response"].dropna().to_numpy()
        row = {"experiment": experiment, "rule": rule, "cohesive": bool(cohesive)}
        row |= {"scale": float(scale), "n": len(values)} | mean_interval(values)
        row |= {"unit": in_ascii(unit_of(RESPONSE[experiment]))}
        rows.append(row | {"left_in_funnel": group["left_in_funnel"].mean()})
    return pd.DataFrame(rows)


def mean_interval(values: np.ndarray) -> dict[str, float]:
    """Mean, sd and the interval of the mean of values (n,), as columns of `response_table`; NaN of
    fewer than two."""
    columns = "mean", "sd", "low", "high"
    if len(values) < 2:
        return dict.fromkeys(columns, np.nan)
    mean, quantile = values.mean(), scipy.stats.t.ppf(1 - ALPHA / 2, len(values) - 1)
    half = quantile * scipy.stats.sem(values)
    return dict(zip(columns, (mean, values.std(ddof=1), mean - half, mean + half), strict=True))


def judge(low: float, high: float, margin: float) -> str:
    """Return whether a change with the interval [low, high] is kept, changed or undecided."""
    if -margin <= low and high <= margin:
        return KEPT
    return CHANGED if low > 0.0 or high < 0.0 else UNDECIDED


def trend(scale: ArrayLike, response: ArrayLike) -> tuple[float, float, float]:
    """(change, low, high) of the responses (n,) from the smallest to the largest scale (n,), by a
    line over log2 of the scale through all runs with a value; NaN with fewer than three of them, or
    none at one of both ends."""
    scale, has = np.asarray(scale, float), np.isfinite(response)
    if has.sum() < 3 or np.ptp(scale[has]) < np.ptp(scale):
        return np.nan, np.nan, np.nan
    octaves = np.log2(scale[has])
    change, half = np.ptp(octaves) * _line(octaves, np.asarray(response)[has])
    return float(change), float(change - half), float(change + half)


def _line(x, y):
    """(slope, half of its 95 % interval) of the straight line through points x (n,), y (n,)."""
    fit = scipy.stats.linregress(x, y)
    return np.array([fit.slope, scipy.stats.t.ppf(1 - ALPHA / 2, len(x) - 2) * fit.stderr])


SAID = {"heap": ("angle of repose", "°", 1), "drop": ("restitution on steel", "", 3)}
"""Experiment -> its response in words, the unit behind a value, and decimals."""


def response_statements(runs: pd.DataFrame, margins: Mapping[str, float]) -> list[dict[str, Any]]:
    """A statement a case: does the response keep its value over the scales? One trend, so that one
    test judges it.

    runs : columns experiment, rule, cohesive, scale, response, NaN of a run without a value
    """
    out = []
    for (experiment, rule, cohesive), case in runs.groupby(
        ["experiment", "rule", "cohesive"], sort=False
    ):
        told = case.dropna(subset="response")
        found, low, high = trend(case["scale"], case["response"])
        margin, response = margins[experiment], SAID[experiment]
        change = judge(low, high, margin)
        how = "with cohesion" if cohesive else "without cohesion"
        means = [(h, v.mean()) for h, v in told.groupby("scale")["response"]]
        ends = (found, low, high) if np.isfinite(low) else None
        runs_of = len(case), len(case) - len(told)
        [sentence] = worded("enlarged")(rule, how, response, means, ends, margin, change, runs_of)
        out.append(
            {
                "id": f"{experiment}.{rule}.{'cohesive' if cohesive else 'plain'}",
                "where": "1.2.1, conclusion 4" if rule == PAPER else "(gravity kept)",
                "statement": f"The {response[0]} does not change with the scale, {how}, under the "
                f"{rule} rule",
                "printed": 0.0,
                **dict(zip(FOUND, ends or (None, None, None), strict=True)),
                "verdict": VERDICT[change],
                "sentence": sentence,
            }
        )
    return out


POWERS = {
    "section122.stiffness": ("k_n over R^2 is constant", 2, "stiffness"),
    "section122.damping": ("c_n over R^2 is constant", 2, "damping_coefficient"),
    "section122.velocity": ("Velocity is invariant", 0, "impact_speed_m_s"),
    "section122.restitution": ("The restitution goes as R^2", 2, "effective_restitution"),
}
"""Claim of 1.2.2 -> statement, exponent, and the quantity of `probe` or metric of the drop."""


def exponent_statements(measured: Mapping[str, float]) -> list[dict[str, Any]]:
    """The exponents of a contact's constants beside those measured in the engine, enlarged by the
    paper's own rule."""
    own = [(claim, measured[q]) for claim, (*_, q) in POWERS.items() if q in measured]
    return [_power(claim, "measured in the engine", found, found, found) for claim, found in own]


def drop_statements(design: pd.DataFrame) -> list[dict[str, Any]]:
    """The exponents of impact speed and restitution over the scale, by a line through the
    logarithms of all drops."""
    drops = design[(design["experiment"] == "drop") & ~design["cohesive"]]
    drops, out = drops[drops["rule"] == PAPER], []
    for claim in ("section122.velocity", "section122.restitution"):
        values = read_metric(drops["run_id"], POWERS[claim][-1])
        slope = log_slope(drops["scale"], values)
        out.append(_power(claim, "of the drop, its rig enlarged alike,", *slope))
    return out


def _power(claim, how, found, low, high):
    """Statement on the exponent of a quantity, known exactly where its ends are one."""
    text, printed, quantity = POWERS[claim]
    verdict = HOLDS if low - EXACT <= printed <= high + EXACT else FAILS
    ends = f" (95 %: {fixed(low, 2)} to {fixed(high, 2)})" if low < high else ""
    what = f"{quantity.removesuffix('_m_s').replace('_', ' ')} {how}"
    return {
        "id": claim,
        "where": "1.2.2",
        "statement": text,
        "printed": printed,
        "found": found,
        "low": low,
        "high": high,
        "verdict": verdict,
        "sentence": f"The {what} goes as h^{fixed(found, 2)}{ends}; printed h^{printed}: the "
        f"statement {verdict}.",
    }


def log_slope(scale: ArrayLike, value: ArrayLike) -> tuple[float, float, float]:
    """(exponent, low, high) of a power law through values (n,) > 0 at scales (n,), by a line
    through the logarithms."""
    slope, half = _line(np.log(np.asarray(scale, float)), np.log(np.asarray(value, float)))
    return float(slope), float(slope - half), float(slope + half)


def scaling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write the table of responses, the figure and the statements."""
    config, design = study.config, read_written(source.design)
    section = config.scaling
    response = np.empty(len(design))
    for experiment, metric in RESPONSE.items():
        here = (design["experiment"] == experiment).to_numpy()
        response[here] = read_values(design.loc[here, "run_id"], metric)
    heap = design["experiment"] == "heap"
    design.loc[heap, "left_in_funnel"] = read_values(design.loc[heap, "run_id"], "in_funnel")
    margins = {"heap": section.margin_deg, "drop": section.margin_restitution}  # type: ignore[union-attr]
    runs = design.assign(response=response)
    table = response_table(runs)
    base = base_run(config, "drop", False)
    drops = {h: enlarged(base, "drop", PAPER_RULE, h) for h in section.factors}  # type: ignore[union-attr]
    statements = [
        *exponent_statements(measured_exponents(drops)),
        *drop_statements(design),
        *response_statements(runs, margins),
    ]
    write_table(runs, output.runs)
    write_table(table, output.table)
    figures.save(scaling_figure(table), output.figure)
    write_json(output.summary, {"statements": statements})


def scaling_figure(table: pd.DataFrame) -> figures.Drawing:
    """Angle of repose and restitution over the scale, a line a rule and cohesion."""
    figure, axes = figures.subplots(1, 2, (9.6, 4.2))
    names = {"heap": figures.ANGLE.axis, "drop": "coefficient of restitution, rebound"}
    for ax, (experiment, axis) in zip(axes, names.items(), strict=True):
        cases = table[table["experiment"] == experiment].groupby(["rule", "cohesive"], sort=False)
        for k, ((rule, cohesive), case) in enumerate(cases):
            text = f"{rule} rule, {'cohesive' if cohesive else 'no cohesion'}"
            ax.errorbar(
                case["scale"] * 2 ** (0.03 * (k - 1.5)),
                case["mean"],
                yerr=[case["mean"] - case["low"], case["high"] - case["mean"]],
                marker="o",
                capsize=3,
                label=text,
            )
        ax.set_xscale("log", base=2)
        scales = sorted(table["scale"].unique())
        ax.set_xticks(scales, [f"{x:g}" for x in scales])
        ax.set(xlabel="scale h", ylabel=axis)
    lines = axes[0].get_legend_handles_labels()
    figure.legend(*lines, loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    return figure


STAGES = (
    Stage(
        name="scaling",
        title="Scaling of the particles",
        place=7.5,
        plans=(Plan("scaling", lambda config, _: [case for case, *_ in _cases(config)], 4),),
        figures=(Figure("scaling"),),
        tables=(("scaling", "Scaling"),),
        about="What coarser particles change, and which rule keeps what.",
        unshown=("sd", "left_in_funnel"),
    ),
)
