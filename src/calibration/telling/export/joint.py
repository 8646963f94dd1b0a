"""The stage `joint_export`: a set of parameters by all tests of the laboratory, as input for other
codes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.distance import cdist

from calibration.chain.joint.analysis import INSIDE
from calibration.chain.joint.emulators import free_factors
from calibration.engines.conversion import left_out
from calibration.figures import label
from calibration.intake.tables import read_written
from calibration.statistics.ties import first_least
from calibration.telling.export.rolling import calibrated_spec
from calibration.telling.export.stage import engine_of, known_parameters, made_by, write_set
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of, without_unit

if TYPE_CHECKING:
    import pandas as pd

    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.factors import Choice, Factor


def middle(draws: pd.DataFrame) -> dict[str, float]:
    """{factor: level} of the medoid of draws (n, d): the one with the least distance to all others.

    Distance is by the covariance of the draws (Mahalanobis). Of draws that are as near but for
    rounding, the first one is taken. The means of parameters that hang together are no set that
    meets the measurements; a draw is one.
    """
    values = draws.to_numpy(float)
    sd = values.std(axis=0)
    scaled = values / np.where(sd > 0.0, sd, 1.0)  # units do not spoil the inverse
    shape = np.linalg.pinv(np.atleast_2d(np.cov(scaled, rowvar=False)))
    nearest = first_least(cdist(scaled, scaled, "mahalanobis", VI=shape).sum(axis=1))
    return {str(name): float(x) for name, x in zip(draws.columns, values[nearest], strict=True)}


def joint_entries(
    factors: Sequence[Factor | Choice], parameters: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """{key: entry of calibrated.yaml} of the free factors; parameters: those of joint.json."""
    found = {}
    for f in factors:
        low, high = parameters[f.name]["interval"]
        spare = INSIDE * (f.high - f.low)
        found[f.key] = {
            "source": "calibrated to all tests",
            "factor": f.name,
            "interval_95": [low, high],
            "region": [f.low, f.high],
        }
        # as `joint.json` counts a parameter as bounded
        ends = (("low", low <= f.low + spare), ("high", high >= f.high - spare))
        if sides := [side for side, reached in ends if reached]:
            found[f.key]["not_bounded_by_the_data"] = sides
    return found


def _expected(predictions):
    """What a run of each rig is expected to give, of predictions.csv."""
    return [
        {
            "rig": row["rig"],
            "metric": row["metric"],
            "unit": in_ascii(unit_of(row["metric"])),
            "mean": row["mean"],
            "a_run_95": [row["run_low"], row["run_high"]],
        }
        for row in predictions.to_dict("records")
    ]


def _told(row, value):
    """A value of a row's metric and rig, in words."""
    words, unit = label(without_unit(row["metric"])), in_ascii(unit_of(row["metric"]))
    return f"{words} ({row['rig']}) {value:.4g} {unit}".rstrip()


def _about(config, summary, expected):
    """Lines of provenance for the head of each file."""
    measured = "; ".join(_told(t, t["measured"]) for t in summary["targets"])
    told = "; ".join(
        f"{_told(e, e['mean'])}, a run {{:.4g}} to {{:.4g}}".format(*e["a_run_95"])
        for e in expected
    )
    apart = summary["agreement"]["contradicts"]
    return [
        f"Study {config.name}, calibrated to all tests together: {measured}.",
        "The values are one set, the middle one of those that meet the tests; the others stand in "
        "joint/draws.csv. No run was made with it alone.",
        f"Expected by all sets (95 %): {told}.",
        *(["THE TESTS CONTRADICT EACH OTHER: no set meets them all."] if apart else []),
        made_by(config),
    ]


def joint_export(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write calibrated.yaml and the files of other codes beside it, without any run."""
    config, found = study.config, study.summary("joint")
    mapping = calibrated_spec(config, study.factors, middle(read_written(source.draws)))
    spec, expected = parse_spec(mapping), _expected(read_written(source.predictions))
    calibrated = joint_entries(free_factors(study), found["parameters"])
    data = {
        "study": config.name,
        "engine": engine_of(config),
        "targets": [
            {k: t[k] for k in ("rig", "metric", "measured", "predicted", "pull", "p_others")}
            for t in found["targets"]
        ],
        "expected": expected,
        "parameters": known_parameters(study, spec, calibrated),
        "not_converted": left_out(spec),
    }
    lines, folder = _about(config, found, expected), Path(output.parameters).parent
    write_set(mapping, data, lines, folder, output.parameters)
