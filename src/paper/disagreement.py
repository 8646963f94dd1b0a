"""Why this project's simulations and the paper's disagree: Tables 6, 8, 9, 10 and 11, made with
EDEM, read as another code's runs at known parameters.

Our side are the runs of the chain and of the bench tests at the same parameters. What may differ is
switched on in the integrated contact, in the reading, or in runs of the engine at each row of the
table (`config/disagreement.yaml`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from calibration.engines.templates import macros
from calibration.errors import CalibrationError
from calibration.files import read_json, write_table, write_text
from calibration.intake.quantities import QUANTITIES, measurable
from calibration.intake.tables import read_written
from calibration.runs.plans import write_plan
from calibration.runs.simulated import simulate
from calibration.statistics.surface import pure_error
from calibration.study.config import overlay, point_spec
from dem.io.files import write_json
from diagnosis import other_code
from diagnosis.compared import compare, in_part, told
from diagnosis.rig import Rig
from diagnosis.settings import catalogue_of, parameters_of, study_settings
from diagnosis.switched_causes import plan, read_switched, tried
from paper.audit.paper import TABLES, Paper, levels
from paper.reproduction.chain import runs_at, simulated_sd
from paper.reproduction.study import Study

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study as CalibratedStudy
    from calibration.intake.measurements import Measurement
    from diagnosis.switched_causes import Switched


LEVERS = {
    "tilt": ("tilt_rate_deg_s", "inclined_plane_tilt_rate"),
    "drop": ("drop_height_mm", "drop_height"),
}
"""Experiment -> lever that the paper states once for all rows, and its name there."""
FEWEST = 2
"""Rows that can be compared: the scatter of a row is told by the others."""
OURS = ("screening", "ascent", "response_surface")
"""Stages whose runs are our side of the heaps."""


def runs_table(paper: Paper, name: str, fixed: Mapping[str, float | str]) -> pd.DataFrame:
    """A table of the paper in the form of `diagnosis.other_code.read_runs`; fixed: {factor: level}
    of what the table itself does not vary."""
    table = TABLES[name]
    points = levels(paper, name).assign(value=paper.numbers(table.file, table.column).iloc[:, 0])
    rest = {k: v for k, v in fixed.items() if k not in points} if table.experiment == "heap" else {}
    q = QUANTITIES[table.experiment]
    head = {"experiment": table.experiment, "quantity": q.name, "unit": q.unit}
    if table.experiment in LEVERS:
        lever, scalar = LEVERS[table.experiment]
        rest = {lever: paper.value(scalar)}
    return points.assign(**head, **rest)


def our_values(
    runs: Sequence[Measurement],
    groups: Sequence[Sequence[Study]],
    fixed: Mapping[str, float | str],
) -> tuple[np.ndarray, np.ndarray]:
    """(our responses (n,) at the parameters of runs, how many heaps each is the mean of (n,)), from
    the tables of `groups` of studies: the studies of a group are one rig at several seeds, and the
    first group with runs at a point counts. NaN and 0 where no run of ours gave a value. Raises
    CalibrationError where a row has no run of ours, or fewer than FEWEST have a value."""
    tables = [
        [t for s in group for t in (s.table(stage, "runs") for stage in OURS) if t is not None]
        for group in groups
    ]
    values = [_at(dict(m.known), tables, fixed) for m in runs]
    missing = sum(v is None for v in values)
    if missing:
        raise CalibrationError(
            f"{missing} of {len(runs)} rows have no run of ours at their parameters"
        )
    counts = np.array([len(v) for v in values])
    if (counts > 0).sum() < FEWEST:
        raise CalibrationError(
            f"{(counts > 0).sum()} of {len(runs)} rows have a run of ours that gave a value; "
            f"{FEWEST} or more are needed"
        )
    return np.array([v.mean() if len(v) else np.nan for v in values]), counts


def _at(known, groups, fixed):
    """Responses (k,) of the first group of tables with runs at these levels, without those that
    gave no value; None without a run."""
    for tables in groups:
        here = []
        for table in tables:
            held = {k: fixed.get(k, math.nan) for k in known if k not in table}
            here.append(runs_at(table.assign(**held), known)["response"])
        if any(len(found) for found in here):
            return pd.concat(here).dropna().to_numpy(float)
    return None


def spec_of(
    study: CalibratedStudy,
) -> Callable[[Measurement, dict[str, float], dict[str, Any]], dict[str, Any]]:
    """(`Measurement`, {factor: value}, keys laid over) -> run spec of the study's own experiment or
    of its bench test."""
    keys, config = {f.name: f.key for f in study.factors}, study.config

    def made(run, values, changes):
        kind = run.experiment
        if kind == config.experiment:
            base = overlay(config.own_run, changes)
        else:
            base = overlay(config.run_of(config.of_experiment(kind)), changes)
            base = overlay(base, {k: v for k, v in changes.items() if k == "materials"})
        levels = {keys[k]: v for k, v in (config.fixed | values).items()}
        return point_spec(base, kind, levels, config.seed)

    return made


def plan_disagreement(study: CalibratedStudy, source: NamedFiles, output: NamedFiles) -> None:
    """Write the paper's tables as tables of runs, and plan every cause at each of their rows."""
    paper, causes = Paper(Path(source.tables[0]).parent), read_switched(source.causes)
    rows, specs = [], {}  # type: ignore[var-annotated]
    for name, path in zip(TABLES, output.simulated, strict=True):
        write_table(runs_table(paper, name, study.config.fixed), path)
        runs = other_code.read_runs(path, study.factors)
        more, own = plan(name, runs, causes.get(runs[0].experiment, {}), spec_of(study))
        rows, specs = rows + more, specs | own
    write_plan(output.plan, pd.DataFrame(rows), specs)


def disagreement(study: CalibratedStudy, source: NamedFiles, output: NamedFiles) -> None:
    """Say of each table what differs, or that none of the causes tried explains it."""
    paper, causes = Paper(Path(source.tables[0]).parent), read_switched(source.causes)
    groups = [
        [Study(study.folder), *map(Study, sorted({Path(p).parents[1] for p in source.repeats}))],
        *([Study(Path(p).parents[1])] for p in source.beside),
    ]
    rows, metrics = read_written(source.design), simulate(read_json(source.plan))
    found = {}
    for name, path in zip(TABLES, source.simulated, strict=True):
        runs = other_code.read_runs(path, study.factors)
        own = rows[rows["table"] == name].to_dict("records")
        found[name] = of_table(study, paper, runs, groups, own, causes, metrics)
    write_json(output.summary, found)
    write_text(page(found), output.page)


def of_table(
    study: CalibratedStudy,
    paper: Paper,
    runs: list[Measurement],
    groups: Sequence[Sequence[Study]],
    rows: list[dict[str, Any]],
    causes: Mapping[str, Mapping[str, Switched]],
    metrics: Mapping[str, dict[str, float] | None],
) -> dict[str, Any]:
    """What `diagnosis.compared.compare` says of one table, with the values of each row: heaps
    beside the runs of `groups` of studies (`our_values`), slides and drops beside integrated
    contacts. rows, causes: what was switched on, as of `diagnosis.switched_causes.plan`, with the
    metrics {run: metrics} of its runs."""
    kind, apart, lost, spreads = runs[0].experiment, None, [], {}
    here = causes.get(kind, {})
    if kind == study.config.experiment:
        ours, counts = our_values(runs, groups, study.config.fixed)
        has = ~np.isnan(ours)
        lost = [m.line for m, there in zip(runs, has, strict=True) if not there]
        runs = [m for m, there in zip(runs, has, strict=True) if there]
        ours, rows = ours[has], [r for i, r in enumerate(rows) if has[i % len(has)]]
        known = other_code.conventions(runs, ours)
        scatter = next(own[0] for group in groups for s in group if (own := s.seed_spread()))
        apart = _apart(scatter, counts[has], paper, runs)
        spreads = spreads_of(paper, runs, rows, here, metrics, study.folder.parent)
    else:
        settings = study_settings(study.config)
        factors = tuple(parameters_of(settings, study.config.factors, [kind]))
        rig = Rig(settings, study.config.own_run, factors)
        ours, known = other_code.of_contacts(runs, rig, catalogue_of(settings, [kind]))
    metric = measurable(kind)[runs[0].quantity].key
    more, without = tried(rows, here, metrics, metric, spreads)
    found = compare(runs, ours, known + more, spread=apart)
    theirs = [m.value for m in runs]
    values = {c.name: c.values[np.abs(c.values - theirs).sum(1).argmin()] for c in more}
    found["rows"] = [
        {"line": m.line, "theirs": m.value, "ours": float(o)}
        | {name: float(v[i]) for name, v in values.items()}
        for i, (m, o) in enumerate(zip(runs, ours, strict=True))
    ]
    found["without_value"] = {k: in_part(runs, ours, v) for k, v in without.items()}
    return found | {"ours_without_value": lost}


def spreads_of(
    paper: Paper,
    runs: Sequence[Measurement],
    rows: list[dict[str, Any]],
    causes: Mapping[str, Switched],
    metrics: Mapping[str, dict[str, float] | None],
    folder: Path,
) -> dict[str, float]:
    """{cause: standard deviation [deg] of the difference of two heaps, theirs and the mean of the
    cause's own}: by what its own runs scatter at one row, where a row has several; else by the
    validation of the study in `folder` that has its rig, where there is one."""
    found, metric = {}, measurable(runs[0].experiment)[runs[0].quantity].key
    for name, cause in causes.items():
        own = [r for r in rows if r["cause"] == name]
        table = np.array(
            [(metrics[r["run"]] or {}).get(cause.metric or metric, np.nan) for r in own]
        )
        table = table.reshape(-1, len(runs))  # (strengths and seeds, rows)
        has, sd = np.isfinite(table), None
        counts = has.sum(0)
        if len(cause.overlays) == 1 and counts.max() > 1:
            square, freedom = pure_error(np.nonzero(has)[1][:, None], table[has])
            sd = math.sqrt(square / freedom)
        if sd is None and cause.scatter_of:
            sd = (Study(folder / cause.scatter_of).seed_spread() or (None,))[0]
        if sd is not None and counts.all():
            found[name] = _apart(sd, counts, paper, runs)
    return found


def _apart(sd, counts, paper, runs):
    """Standard deviation [deg] of the difference of two heaps at a row, the root mean square over
    the rows: ours the mean of `counts` (n,) that scatter by `sd`, theirs of as many as the table
    has there."""
    theirs = simulated_sd(paper)[0] ** 2 / np.array([m.n for m in runs])
    return float(math.sqrt(np.mean(sd**2 / counts + theirs)))


def page(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Markdown: a sentence and a ranking for each table."""
    return macros("paper", "disagreement.md").page(found, told)
