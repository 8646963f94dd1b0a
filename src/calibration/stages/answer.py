"""The stage `answer`: every measured row is simulated at the parameters that the study hands out,
whichever way they were found, and answer.json says how it compares."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy

from calibration import engines, figures
from calibration.chain.study import NamedFiles, Study
from calibration.figures import WORDS, label, response_of
from calibration.files import read_json, write_table
from calibration.intake.measurements import Measurement, read_measured
from calibration.intake.quantities import measurable
from calibration.intake.tables import read_written
from calibration.runs.plans import read_plan, together, write_plan
from calibration.runs.store import RunStore
from calibration.stages.joint import against, tells_most
from calibration.stages.validation import handed_out
from calibration.study.config import point_spec
from calibration.study.config.joint import handed_out_by
from calibration.study.simulated_tests import SimulatedTest, at_setting, test_of, tests_of
from calibration.study.stage import Figure, Plan, Stage
from calibration.telling.answer import schema, words
from calibration.telling.export import parameters
from dem.errors import DemError, ResultError
from dem.io.files import write_json
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of

RUNS = 4
"""Runs at each measured setting, and of the study's own test with the level that a bench test found
in place of the study's, with seeds of their own: beside 10 validated heaps these four tell a change
of the mean to 1.3 standard deviations of a heap (95 %)."""
ALPHA = 0.05
"""Chance, over all judged rows, at which one that is right is said to be missed."""
PARTS = ("contacts.", "materials.", "law_parameters.", "laws.", "particles.")
PURE = "1"
"""Unit of a pure number in calibrated.yaml."""


def plan_answer(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan runs at the parameters handed out: of each measured row at its own setting, but for the
    calibrated one, which the validation has; and of the study's own test at the levels that bench
    tests found in place of the study's."""
    levels, parts = handed_out(source), []
    for n, row, test in _rows(study):
        if test and not (row.outcome or _validated(study, row, test) or _refused(test)):
            design = pd.DataFrame([{"row": n, "instead": ""} | levels] * RUNS)
            with suppress(DemError, ValueError):  # told by the analysis, which finds no run
                parts.append(study.plan_test(design, test))
    own = tests_of(study.config)[0]
    for name, level, _ in _disputed(study, source, levels):
        design = pd.DataFrame([{"row": -1, "instead": name} | levels | {name: level}] * RUNS)
        parts.append(study.plan_test(design, own))
    table, specs = together(parts) if parts else (pd.DataFrame({"run_id": []}), {})
    write_plan(output.plan, table, specs)


def _rows(study: Study) -> Iterator[tuple[int, Measurement, SimulatedTest | None]]:
    """(number, row, its test at its setting, None where none stands for it) of the measured
    conditions, those that are held out of a diagnosis among them."""
    tests = tests_of(study.config)
    for n, row in enumerate(read_measured(study.config.measurements).conditions):
        test = test_of(tests, row)
        yield n, row, test and at_setting(test, row)


def _validated(study, row, test):
    """Return whether the validation has simulated a row: the study's target, in a run that is the
    study's own."""
    own = test.experiment == study.config.experiment and test.run == study.config.own_run
    metric = measurable(row.experiment)[row.quantity].key
    return own and not test.fixed and metric == study.config.target


def _only(files):
    """The file of a list that holds one or none, or None."""
    return files[0] if files else None


def _refused(test):
    """Why no run can be made of a test, in words; "" where one can."""
    try:
        engines.check(parse_spec(point_spec(test.run, test.experiment, {}, 1)))
    except DemError as error:
        return str(error)
    return ""


def _disputed(study, source, levels):
    """(factor, level, test) where a bench test of the study finds another level of a factor than is
    handed out: the interval of its level does not hold the one handed out."""
    config, levels = study.config, study.config.fixed | levels
    for file in source.bench:
        found, test = read_json(file), Path(file).stem
        name = found["factor"]
        if found["inverse"] is None or name not in levels:
            continue
        low, high = _of_the_bench(config, test, found)
        if not low <= levels[name] <= high:
            yield name, round(found["inverse"], 4), test


def _of_the_bench(config, test, found):
    """Interval (95 %) of the level that a bench test found: of the shear's fit, or where the
    sweep's quadratic gives the measured value give or take its error."""
    if "inverse_interval" in found.get(found.get("measure", ""), {}):
        return found[found["measure"]]["inverse_interval"]
    rows = [m for m in read_measured(config.measurements).conditions if m.experiment == test]
    errors = [_error(m)[0] for m in rows]
    if not errors or errors[0] is None:
        return found["inverse"], found["inverse"]
    reach = scipy.stats.t.ppf(1 - ALPHA / 2, max(rows[0].n - 1, 1)) * errors[0]
    slope = abs(np.polyval(np.polyder(found["quadratic"]), found["inverse"]))
    return found["inverse"] - reach / slope, found["inverse"] + reach / slope


def answer(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Compare, and write answer.json and the table of tests."""
    config, levels = study.config, handed_out(source)
    by = handed_out_by(config)
    design = read_written(source.design)
    tests = [*_compared(study, source, design), *_predictions(source)]
    instead = [*_instead(study, source, design, levels)]
    beside = _beside(source, levels) if by == "chain" else []
    found = schema.Answer(
        study=config.name,
        engine=parameters.engine_of(config),
        by=by,
        parameters=_parameters(study, source, levels),
        tests=tests,
        wrong=_wrong(study, source, tests, instead, beside),
        beside=beside,
        next=_next(source, by),
        runs=_runs(source),
    )
    write_json(output.answer, found.model_dump(mode="json"))
    judged = [(words.title(t), t.pull, t.state == "missed") for t in tests if t.pull is not None]
    figures.save(pulls(judged), output.figure)
    rows = [t.model_dump() for t in tests]
    for row in rows:
        row["setting"] = words.setting(row["setting"])
        row["low"], row["high"] = row.pop("interval_95") or (None, None)
    write_table(pd.DataFrame(rows), output.tests)


def _compared(study, source, design):
    """`Test` of each measured row."""
    config, rows = study.config, []
    validated = read_written(source.validated)
    for n, row, test in _rows(study):
        metric = measurable(row.experiment)[row.quantity].key
        values, why, name = np.array([]), "", test.name if test else row.experiment
        if row.outcome:
            why, name = f"the laboratory's test ended with {label(row.outcome)}", row.experiment
        elif test is None:
            why = f"no test of the configuration is a {row.experiment}"
        elif _validated(study, row, test):
            column = "response" if metric == config.target else metric
            values = validated[column].dropna().to_numpy(float)
        else:
            names = design.loc[design["row"] == n, "run_id"] if "row" in design else []
            values, why = _values(names, metric)
            why = why or _refused(test)
        rows.append(_row(row, name, metric, values, why))
    count = sum(t.p is not None for t in rows)
    return [_judged(config, t, count) for t in rows]


def _values(names, metric):
    """(values of a metric of finished runs, why those without one have none)."""
    store, values, why = RunStore(), [], ""
    for name in names:
        try:
            result = store.result(name)
        except ResultError:
            why = (store.failure(name) or {}).get("error", "the run is missing")
            continue
        if metric in result["metrics"]:
            values.append(result["metrics"][metric])
        else:
            why = result["numerics"].get("refused", {}).get("reason", f"no run gave {metric}")
    return np.array(values, float), why


def _error(row):
    """(standard error of a row's mean, its degrees of freedom); (None, inf) where nobody states
    it."""
    if row.outcome or row.sd is None:
        return None, np.inf
    return row.sd / np.sqrt(row.n), row.n - 1.0 if row.n > 1 else np.inf


def _row(row, name, metric, values, why):
    """`Test` of a row as far as it is known before all are: p is that of its own pull."""
    error, freedom = _error(row)
    mean = float(values.mean()) if len(values) else None
    # a single run says nothing of its scatter
    own = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None
    pull = p = None
    if mean is not None and own is not None and error is not None:
        whole = np.hypot(error, own)
        parts = (error**4 / freedom, own**4 / (len(values) - 1))
        behind = whole**4 / sum(parts) if sum(parts) else np.inf
        pull = float((row.value - mean) / whole)
        p = float(2 * scipy.stats.t.sf(abs(pull), behind))
    note = why
    if mean is not None and error is None:
        note = "a single reading without a standard deviation: nobody can judge it"
    return schema.Test(
        test=name, metric=metric, setting=dict(row.levers), unit=in_ascii(unit_of(metric)),
        measured=None if row.outcome else row.value, error=error, n=row.n, predicted=mean,
        predicted_sd=own,
        interval_95=None, runs=len(values), pull=pull, p=p,
        state="not simulated" if mean is None else "not judged", note=note,
    )  # fmt: skip


def _judged(config, test, count):
    """The test with its verdict; p counts for as many rows as are judged. A calibrated response
    stands for itself, as its validation has it, and is met however well it is known where it
    differs by less than the margin."""
    if test.p is None:
        return test
    calibrated = (test.test, test.metric) == (config.own, config.target)
    p = test.p if calibrated else min(test.p * count, 1.0)
    margin = config.validation.margin if calibrated else 0.0
    near = abs(test.measured - test.predicted) < margin
    found = {"p": p, "state": "missed" if p < ALPHA and not near else "met"}
    if p < ALPHA and near:
        found["note"] = f"within its margin of {margin:g} {test.unit}"
    return test.model_copy(update=found)


def _predictions(source):
    """`Test` of each metric of a machine that nobody has measured."""
    for file in source.machines:
        for row in read_json(file)["metrics"]:
            if row["measured"] is None and row["low"] is not None:
                yield schema.Test(
                    test=row["machine"], metric=row["metric"], setting={},
                    unit=in_ascii(unit_of(row["metric"])), measured=None, error=None, n=None,
                    predicted=row["mean"], predicted_sd=None,
                    interval_95=(row["low"], row["high"]), runs=row["runs"], pull=None, p=None,
                    state="prediction", note="",
                )  # fmt: skip


def _instead(study, source, design, levels):
    """`Instead` of each disputed parameter."""
    whole, metric = study.config.fixed | levels, study.config.target
    validated = read_written(source.validated)["response"].dropna().to_numpy(float)
    for name, level, test in _disputed(study, source, levels):
        values, _ = _values(design.loc[design["instead"] == name, "run_id"], metric)
        change, ends = None, None
        if len(values) > 1:
            found = scipy.stats.ttest_ind(values, validated, equal_var=False)
            low, high = found.confidence_interval(1 - ALPHA)
            change, ends = float(values.mean() - validated.mean()), (float(low), float(high))
        yield schema.Instead(
            parameter=name, handed_out=float(whole[name]), found=level, test=test, metric=metric,
            change=change, change_95=ends, runs=len(values),
        )  # fmt: skip


def _beside(source, levels):
    """`Beside` of each calibrated parameter that the joint posterior knows."""
    file = _only(source.joint)
    known = read_json(file)["parameters"] if file else {}
    return [
        schema.Beside(parameter=name, handed_out=level, all_tests_95=tuple(known[name]["interval"]),
               inside=known[name]["interval"][0] <= level <= known[name]["interval"][1])
        for name, level in levels.items() if name in known
    ]  # fmt: skip


def _parameters(study, source, levels):
    """`Parameter` of every key of the model that is handed out."""
    mapping = parameters.calibrated_spec(study.config, study.factors, levels)
    free = {f.key: f.name for f in study.factors if f.name in levels}
    calibrated = {key: {"source": "calibrated", "factor": name} for key, name in free.items()}
    entries = parameters.known_parameters(study, parse_spec(mapping), calibrated)
    known = _intervals(study, source)
    return [
        schema.Parameter(
            key=key,
            name=label(free[key]) if key in free else words.name_of(key),
            symbol=WORDS["symbol"].get(key.rpartition(".")[2]),
            value=entry["value"],
            unit=entry.get("unit", "").removeprefix(PURE),
            **known.get(free.get(key), NOT_KNOWN),
            source=_source(entry),
        )
        for key, entry in entries.items()
        if key.startswith(PARTS) and entry["value"] != "none"
    ]


NOT_KNOWN: dict[str, Any] = {"interval_95": None, "interval_of": None, "bounded": None}


def _source(entry):
    """Where the value of an entry of calibrated.yaml comes from, in a word."""
    if entry["source"] == "calibrated":
        return "calibrated"
    if entry["source"] == "bench test":
        return "measured"
    if entry.get("paper", "").endswith(": the same"):
        return "published"
    return "default" if entry["source"] == parameters.DEFAULT else "fixed"


def _intervals(study, source):
    """{factor: its interval, of what, and whether the data bound it}: of the posterior that there
    is, of all tests where they made the parameters, else with the others held."""
    file, of = (_only(source.joint), "all tests") if source.get("draws") else (None, "")
    if not file:
        file, of = _only(source.posterior), "one test"
    if file:
        return {
            name: {"interval_95": tuple(p["interval"]), "interval_of": of, "bounded": p["bounded"]}
            for name, p in read_json(file)["parameters"].items()
        }
    optimum = read_json(source.optimum)
    region = {f["name"]: (f["low"], f["high"]) for f in optimum["region"]}
    found = {}
    for name, (low, high) in optimum.get("interval_95_others_held", {}).items():
        spare = 1e-6 * (region[name][1] - region[name][0])
        inside = low > region[name][0] + spare and high < region[name][1] - spare
        of = "one test, others held"
        found[name] = {"interval_95": (low, high), "interval_of": of, "bounded": inside}
    return found


def _wrong(study, source, tests, instead, beside):
    """`Wrong`: what the rows, the validation, the joint posterior and the diagnosis object to."""
    missed = [t for t in tests if t.state == "missed"]
    count = [t for t in tests if t.p is not None]
    verdict = "missed" if missed else "met" if count else "not judged"
    p, laws = min((t.p for t in count), default=None), []  # type: ignore[type-var]
    joint, diagnosed = _only(source.joint), _only(source.verdict)
    diagnosed = diagnosed and read_json(diagnosed)
    if diagnosed and diagnosed["verdict"] == "adequate":
        diagnosed = None
    if diagnosed:
        verdict, laws = diagnosed["verdict"], list(diagnosed["causes"])
    said = words.said(
        "objections", tests, instead, {i.parameter: _origin(study, i.parameter) for i in instead},
        read_json(source.validation), response_of(study.config.target),
        handed_out_by(study.config), against(read_json(joint)) if joint else [], beside, diagnosed,
    )  # fmt: skip
    rows = [words.title(t) for t in missed]
    sentence = " ".join(said or words.said("nothing_wrong", tests))
    return schema.Wrong(
        verdict=verdict, p=p, laws=laws, rows=rows, instead=instead, sentence=sentence
    )


def _origin(study, name):
    """Where the level of a factor that was not calibrated comes from, in words."""
    [factor] = [f for f in study.factors if f.name == name]
    spec = parse_spec(parameters.calibrated_spec(study.config, study.factors, {}))
    entry = parameters.known_parameters(study, spec, {})[factor.key]
    where, _, printed = entry.get("paper", "").partition(": ")
    return f"as printed, {where}" if printed == "the same" else entry["source"]


def _next(source, by):
    """`Next` of the posterior that made the parameters, None without one."""
    file = _only(source.joint if by == "joint" else source.posterior)
    if not file:
        return None
    found = read_json(file)
    if not found["next_test"]:
        return None
    best, name, share = tells_most(found)
    return schema.Next(
        test=best["rig"], metric=best["metric"], readings=found["readings"],
        hours=best["hours"], parameter=name, left=share,
    )  # fmt: skip


def _runs(source):
    """`Runs` of the plans of the calibration and of this stage."""
    store = RunStore()
    names = {name for file in (*source.plans, source.plan) for name in read_plan(file)}
    failed, seconds = 0, 0.0
    for name in sorted(names):
        try:
            seconds += store.result(name)["numerics"].get("wall_time_s", 0.0)
        except ResultError:
            failed += 1
    return schema.Runs(made=len(names) - failed, failed=failed, seconds=round(seconds, 1))


SHADE = 2.0
"""Standard errors of the band."""


def pulls(rows: Sequence[tuple[str, float, bool]]) -> figures.Drawing:
    """The pull of each judged row beside a band of two standard errors; rows: (name, pull, whether
    it is missed), the first on top."""
    figure, ax = figures.subplots(size=(6.4, 0.9 + 0.34 * max(len(rows), 1)))
    ax.axvspan(-SHADE, SHADE, color=figures.BLUE, alpha=0.1, lw=0)
    ax.axvline(0.0, color=figures.GREY, lw=1.0)
    for k, (_, pull, missed) in enumerate(rows):
        colour = figures.ORANGE if missed else figures.BLUE
        ax.plot([0.0, pull], [k, k], color=colour, lw=2.0, ls="-")
        ax.plot(pull, k, "o", color=colour)
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.invert_yaxis()
    ax.margins(y=0.15)
    ax.set_xlabel("measured less predicted, in standard errors")
    return figure


STAGES = (
    Stage(
        name="answer",
        title="Every measured value",
        place=5.05,
        chain=True,
        # a measured row that cannot be simulated is told, and stops nothing
        figures=(Figure("pulls", ("tests.csv", "answer.json")),),
        plans=(Plan("answer", batches=2, kept=True),),
    ),
)
