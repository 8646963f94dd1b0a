"""What the calibrated base model gets wrong: the residual of each setting, the discrepancy along
each lever (Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63:425), and the calibrated coefficients.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calibration.figures import parameter_words
from calibration.intake.measurements import Measurement
from calibration.statistics.numbers import NORMAL_95
from diagnosis.design import WIDENED
from diagnosis.fit import Fit
from diagnosis.model import Model
from diagnosis.page.words import told
from diagnosis.table_model.block import Block
from diagnosis.table_model.terms import smooth_terms


def residual_rows(
    measurements: Sequence[Measurement], **values: np.ndarray
) -> list[dict[str, Any]]:
    """A mapping for each condition: its levers and what was recorded beside, measured, and what is
    `values` (n,) of all.

    Values are `predicted` (with what its batch and its instrument add), its `sd`, of emulated
    experiments that of the reading alone, `reading_sd`, and the residual in sd, `standardised`."""
    return [
        {"experiment": m.experiment, "levers": m.levers | m.covariates, "measured": m.value}
        | {key: float(own[i]) for key, own in values.items()}
        for i, m in enumerate(measurements)
    ]


def moved(
    before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Parameters that the extended model still determines, outside the base calibration's interval.

    {name: {base, extended, shift_percent, shift_in_base_sd, sentence}}; the shift is how wrong the
    base had been."""
    out = {}
    for name, old in before.items():
        new = after[name]
        if not new["identified"] or old["low"] <= new["value"] <= old["high"]:
            continue
        shift = old["value"] - new["value"]
        row: dict[str, Any] = {"base": old["value"], "extended": new["value"]}
        row |= {"shift_percent": float(100.0 * shift / new["value"])}
        row |= {"shift_in_base_sd": float(shift / old["sd"])}
        out[name] = row | {"sentence": told("moved.j2", words=new["words"], row=row)}
    return out


def calibration(model: Model, fitted: Fit) -> dict[str, dict[str, Any]]:
    """A mapping for each parameter: mode, standard deviation, 95 % interval cut at the emulators'
    range, the share of the prior's sd that is left, and whether the data identify it (the data must
    halve the prior's sd)."""
    out = {}
    sd = np.sqrt(np.diag(fitted.cov[0]))
    for k, factor in enumerate(model.factors):
        mode = fitted.theta[0, k]
        ends = (np.clip(mode + z * sd[k], -WIDENED, WIDENED) for z in (-NORMAL_95, NORMAL_95))
        own = *(factor.natural(float(v)) for v in (mode, *ends)), sd[k] / model.prior_sd[k]
        value, low, high, left = map(float, own)
        out[factor.name] = calibrated(
            factor.key, value, float(sd[k] * factor.half_range), low, high, left,
            bool(abs(mode) > WIDENED - 0.01),
        )  # fmt: skip
    return out


def calibrated(
    key: str, value: float, sd: float, low: float, high: float, left: float, at_bound: bool
) -> dict[str, Any]:
    """What is told of a calibrated coefficient; left: of the prior's standard deviation."""
    out = {"value": value, "sd": sd, "low": low, "high": high, "prior_sd_left": left}
    more = {"identified": left < 0.5, "at_bound": at_bound, "words": parameter_words(key)}
    return {**out, **more}


def curves(blocks: Mapping[str, Block]) -> list[dict[str, Any]]:
    """[{experiment, lever, at, value, low, high}]: what coefficients alone miss along each lever,
    at its levels, as shares of the reading. The band holds each point with 95 %.

    blocks: of the table, whose terms do not count."""
    out = []
    for block in blocks.values():
        bare = replace(block, held={})
        for lever, term in smooth_terms(block):
            own, at = block.readings.of(term.experiment)
            mean, sd = bare.holding(lever, term).part_of(lever)
            first = np.array([index[0] for index in own.folds[lever]])
            row = {"experiment": term.experiment, "lever": lever}
            row["at"] = own.levers[lever][first].tolist()
            for name, z in (("value", 0.0), ("low", -NORMAL_95), ("high", NORMAL_95)):
                logs = (mean + z * sd)[at[first]]
                row[name] = np.expm1(logs / own.relative[first]).tolist()
            out.append(row)
    return out
