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
from calibration.engines.blocks.conversion import Conversion
from calibration.engines.blocks.header import left_out
from calibration.files import write_text
from calibration.intake.tables import read_written
from calibration.telling.export.parameters import (
    entries,
    fixed_entries,
    published_values,
    to_yaml,
)
from calibration.telling.export.rolling import calibrated_spec
from calibration.telling.export.stage import BY_HAND, CONVERTED, engine_of, write_blocks
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of, without_unit

if TYPE_CHECKING:
    import pandas as pd

    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.factors import Choice, Factor


def middle(draws: pd.DataFrame) -> dict[str, float]:
    """{factor: level} of the medoid of draws (n, d): the one with the least distance to all others.

    Distance is by the covariance of the draws (Mahalanobis). The means of parameters that hang
    together are no set that meets the measurements; a draw is one.
    """
    values = draws.to_numpy(float)
    shape = np.linalg.pinv(np.atleast_2d(np.cov(values, rowvar=False)))
    middle = int(np.argmin(cdist(values, values, "mahalanobis", VI=shape).sum(axis=1)))
    return {str(name): float(x) for name, x in zip(draws.columns, values[middle], strict=True)}


def joint_entries(
    factors: Sequence[Factor | Choice], parameters: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """{key: entry of calibrated.yaml} of the free factors; parameters: those of joint.json."""
    found = {}
    for f in factors:
        known = parameters[f.name]
        low, high = known["interval"]
        spare = INSIDE * (f.high - f.low)
        ends = (("low", low <= f.low + spare), ("high", high >= f.high - spare))
        found[f.key] = {
            "source": "calibrated to all tests",
            "factor": f.name,
            "interval_95": [low, high],
            "region": [f.low, f.high],
        }
        if not known["bounded"]:
            found[f.key]["not_bounded_by_the_data"] = [side for side, open_ in ends if open_]
    return found


def _expected(predictions):
    """{rig: metric}: what a run is expected to give, a row of predictions.csv each."""
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


def _about(study, summary, expected):
    """Lines of provenance for the head of each file."""
    measured = [
        f"{without_unit(t['metric']).replace('_', ' ')} ({t['rig']}) {t['measured']:.4g} "
        f"{in_ascii(unit_of(t['metric']))}"
        for t in summary["targets"]
    ]
    told = [
        f"{without_unit(e['metric']).replace('_', ' ')} ({e['rig']}) {e['mean']:.4g} {e['unit']}, "
        "a run {:.4g} to {:.4g}".format(*e["a_run_95"])
        for e in expected
    ]
    apart = summary["agreement"]["contradicts"]
    return [
        f"Study {study.config.name}, calibrated to all tests together: {'; '.join(measured)}.",
        "The values are one set, the middle one of those that meet the tests; the others stand in "
        "joint/draws.csv. No run was made with it alone.",
        f"Expected by all sets (95 %): {'; '.join(told)}.",
        *(["THE TESTS CONTRADICT EACH OTHER: no set meets them all."] if apart else []),
        f"Engine {engine_of(study.config)}. SI units. How each number was converted: "
        "docs/howto-export.md.",
    ]


def joint_export(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write calibrated.yaml and the files of other codes beside it, without any run."""
    config, summary = study.config, study.summary("joint")
    folder, chosen = Path(output.parameters).parent, middle(read_written(source.draws))
    mapping = calibrated_spec(config, study.factors, {**chosen})
    spec = parse_spec(mapping)
    known = entries(
        spec,
        config.run,
        joint_entries(free_factors(study), summary["parameters"]),
        fixed_entries(config, study.factors, study.bench_levels()),
        published_values(config.published.tables),
        config.published.names,
    )
    expected = _expected(read_written(source.predictions))
    lines = _about(study, summary, expected)
    write_blocks(CONVERTED, mapping, Conversion(spec), lines, folder)
    write_blocks(BY_HAND, mapping, Conversion(spec), lines, folder, known=known)
    head = "".join(f"# {line}\n" for line in lines)
    write_text(head + to_yaml(mapping), folder / "dem.yaml")
    found = {
        "study": config.name,
        "engine": engine_of(config),
        "targets": [
            {k: t[k] for k in ("rig", "metric", "measured", "predicted", "pull", "p_others")}
            for t in summary["targets"]
        ],
        "expected": expected,
        "parameters": known,
        "not_converted": left_out(spec),
    }
    write_text(head + to_yaml(found), output.parameters)
