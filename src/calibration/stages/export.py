"""Export: calibrated.yaml and input for other codes, and the search for the rolling friction that
gives the same angle in the laws of other codes.

What writes for other codes loads the engine, so the functions here import it when they are called.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.chain.responses import with_value
from calibration.chain.study import NamedFiles, Study, read_region
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.stages.joint import free_factors
from calibration.stages.optimum import augmented_runs
from calibration.stages.validation import handed_out
from calibration.statistics.surface import fit_surface
from calibration.study.factors import Factor
from calibration.study.stage import Plan, Stage
from calibration.telling.export.parameters import calibrated_entries, calibrated_spec
from dem.io.files import write_json
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of


def _rolling():
    from calibration.telling.export import rolling

    return rolling


def _spec(study, source):
    return calibrated_spec(study.config, study.factors, handed_out(source))


def plan_export_scan(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the search for rolling friction in other laws."""
    _rolling().plan_scan(_spec(study, source), output)


def plan_export_confirmation(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the runs that confirm what the search found."""
    scan = _rolling().read_scan(source.scan, study.config.target)
    _rolling().plan_confirmation(_spec(study, source), scan, output)


def plan_export_correction(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the runs at a number that is moved by what the one found misses."""
    _rolling().plan_correction(_spec(study, source), _evidence(study, source), output)


def export_rolling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write rolling.json: the conversion of rolling friction."""
    metric = study.config.target
    correction = _rolling().read_scan(source.correction, metric)
    spec, unit = parse_spec(_spec(study, source)), in_ascii(unit_of(metric))
    found = _rolling().conclude(spec, _evidence(study, source), correction, unit)
    write_json(output.rolling, found)


def _evidence(study, source):
    """Return what the search and its confirmation gave."""
    metric = study.config.target
    return _rolling().Evidence(
        _rolling().read_scan(source.scan, metric),
        _rolling().read_scan(source.confirmation, metric),
        study.table("validation", "runs")["response"],
        study.config.validation.margin,
    )


def export(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write calibrated.yaml and exports/ beside it, without any run."""
    from calibration.telling.export.files import write_exports

    if source.get("draws"):
        found = by_joint(study, read_json(source.joint[0]), read_written(source.predictions[0]))
    else:
        region = read_region(source.optimum)
        runs = augmented_runs(study.config, source.runs, region, source.candidate)
        found = by_chain(read_json(source.optimum), runs, region)
    write_exports(study, _spec(study, source), *found, Path(output.parameters).parent)


def by_chain(
    optimum: Mapping[str, Any], runs: pd.DataFrame, region: Sequence[Factor]
) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """({key: entry} of the factors that the chain calibrated, what calibrated.yaml says of the
    solution). optimum: content of optimum.json; runs: those whose values the surface is fitted
    to."""
    fitted = with_value(runs)
    surface = fit_surface(fitted, [f.code for f in region], fitted["response"])
    solution = {
        "rule": optimum["rule"],
        "attainable": optimum["attainable"],
        "predicted": optimum["predicted"],
        "confirmation_interval_95": optimum["confirmation_interval"],
        "note": "One response does not fix several parameters: solution_set is the range of each "
        "over all points that give the measured value. interval_95_others_held covers 95 % only "
        "if the others are exactly right; the stage `posterior` gives the interval that covers it "
        "whatever they are.",
    }
    return calibrated_entries(surface, region, optimum), {"solution": solution}


def by_joint(
    study: Study, found: Mapping[str, Any], predictions: pd.DataFrame
) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """({key: entry} of the factors that all tests calibrated, what calibrated.yaml says of them).
    found: content of joint.json; predictions: table of what is expected of each rig."""
    from calibration.chain.joint.analysis import INSIDE

    entries = {}
    for f in free_factors(study):
        low, high = found["parameters"][f.name]["interval"]
        spare = INSIDE * (f.high - f.low)
        entries[f.key] = {
            "source": "calibrated",
            "factor": f.name,
            "interval_95": [low, high],
            "region": [f.low, f.high],
        }
        # as `joint.json` counts a parameter as bounded
        ends = (("low", low <= f.low + spare), ("high", high >= f.high - spare))
        if sides := [side for side, reached in ends if reached]:
            entries[f.key]["not_bounded_by_the_data"] = sides
    told = ("rig", "metric", "measured", "predicted", "pull", "p_others")
    return entries, {
        "targets": [{k: t[k] for k in told} for t in found["targets"]],
        "expected": _expected(predictions),
        "note": "The values are one set, the middle one of those that meet the tests; the others "
        "stand in joint/draws.csv.",
    }


def _expected(predictions):
    """Return what a run of each rig is expected to give, of predictions.csv."""
    return [
        {"rig": row["rig"], "metric": row["metric"], "unit": in_ascii(unit_of(row["metric"]))}
        | {"mean": row["mean"], "a_run_95": [row["run_low"], row["run_high"]]}
        for row in predictions.dropna(subset="mean").to_dict("records")
    ]


def export_converted(study: Study, source: NamedFiles, output: Sequence[str]) -> None:
    """Write the blocks of codes with other rolling laws, with what the search found."""
    from calibration.telling.export.files import write_converted

    rolling = study.summary("export_correction", "rolling")
    write_converted(study, _spec(study, source), rolling, Path(output[0]).parent)


STAGES = (
    Stage(name="export", title="Export", place=9, chain=True),
    Stage(
        name="exports/converted",
        title="Export with converted rolling friction",
        place=9.1,
        plans=(Plan("export_scan"), Plan("export_confirmation"), Plan("export_correction")),
        made_by="export_converted",
    ),
)
