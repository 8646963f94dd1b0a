"""What calibrated.yaml says of parameters that all tests of the laboratory gave together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calibration.chain.joint.analysis import INSIDE
from calibration.chain.joint.emulators import free_factors
from dem.units import in_ascii, unit_of

if TYPE_CHECKING:
    import pandas as pd

    from calibration.chain.study import Study
    from calibration.study.factors import Choice, Factor


def joint_entries(
    factors: Sequence[Factor | Choice], parameters: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """{key: entry of calibrated.yaml} of the free factors; parameters: those of joint.json."""
    found = {}
    for f in factors:
        low, high = parameters[f.name]["interval"]
        spare = INSIDE * (f.high - f.low)
        found[f.key] = {
            "source": "calibrated",
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


def by_joint(
    study: Study, found: Mapping[str, Any], predictions: pd.DataFrame
) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """({key: entry} of the factors that all tests calibrated, what calibrated.yaml says of them).
    found: content of joint.json; predictions: table of what is expected of each rig."""
    told = ("rig", "metric", "measured", "predicted", "pull", "p_others")
    more = {
        "targets": [{k: t[k] for k in told} for t in found["targets"]],
        "expected": _expected(predictions),
        "note": "The values are one set, the middle one of those that meet the tests; the others "
        "stand in joint/draws.csv.",
    }
    return joint_entries(free_factors(study), found["parameters"]), more
