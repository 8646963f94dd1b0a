"""What the calibrated base model gets wrong: residuals along each lever, and a sentence for each pattern."""

import numpy as np
from scipy import stats

NAMES = {
    "heap": "angle of repose",
    "drop": "rebound",
    "tilt": "sliding angle",
    "shear": "shear stress",
}
UNITS = {"heap": "°", "drop": "mm", "tilt": "°", "shear": "kPa"}


def residual_rows(measurements, fitted):
    """A mapping for each condition: measured, predicted, residual in sd, tail probability when it is left out."""
    rows = []
    for i, m in enumerate(measurements):
        left_out = fitted.residual[0, i] / np.sqrt(1.0 - fitted.leverage[0, i])
        rows.append(
            {
                "experiment": m.experiment,
                "levers": m.levers,
                "measured": m.value,
                "predicted": float(fitted.predicted[0, i]),
                "sd": float(fitted.sd[0, i]),
                "standardised": float(fitted.residual[0, i]),
                "predictive_p": float(2.0 * stats.norm.sf(abs(left_out))),
            }
        )
    return rows


def trends(rows):
    """Spearman's correlation of the residuals with each lever that varies; a sentence where p is below 0.05 or large.

    Each mapping: experiment, lever, correlation, p, sentence.
    """
    out = []
    for kind in dict.fromkeys(r["experiment"] for r in rows):
        own = [r for r in rows if r["experiment"] == kind]
        for lever in dict.fromkeys(n for r in own for n in r["levers"]):
            some = [r for r in own if lever in r["levers"]]
            x = np.array([r["levers"][lever] for r in some])
            if len(some) < 3 or len(set(x)) < 2:
                continue
            found = _trend(kind, lever, x, some)
            if found:
                out.append(found)
    return out


def _trend(kind, lever, x, rows):
    """The weighted slope of the residuals along a lever, where it is more than noise."""
    r = np.array([row["standardised"] for row in rows])
    shape = np.log(x) - np.log(x).mean()
    slope_sd = 1.0 / np.sqrt((shape**2).sum())
    slope = float((shape * r).sum() / (shape**2).sum())
    p = float(2.0 * stats.norm.sf(abs(slope) / slope_sd))
    if p > 0.01:
        return None
    ends = [[row for row, v in zip(rows, x, strict=True) if v == end] for end in (x.min(), x.max())]
    gap = [np.mean([e["measured"] - e["predicted"] for e in end]) for end in ends]
    share = [g / np.mean([e["predicted"] for e in end]) for g, end in zip(gap, ends, strict=True)]
    size = [f"{abs(s):.0%} {'above' if s > 0 else 'below'}" for s in share]
    sentence = (
        f"The measured {NAMES[kind]} lies {size[1]} the model at {lever} = {x.max():g} "
        f"and {size[0]} it at {x.min():g}."
    )
    return {"experiment": kind, "lever": lever, "slope": slope, "p": p, "sentence": sentence}


def calibration(model, fitted):
    """A mapping for each parameter: mode, 95 % interval, the share of the prior's sd that is left, and whether the
    data identify it (the data must halve the prior's sd)."""
    out = {}
    sd = np.sqrt(np.diag(fitted.cov[0]))
    for k, factor in enumerate(model.factors):
        mode = fitted.theta[0, k]
        left = float(sd[k] / model.prior_sd[k])
        out[factor.name] = {
            "value": float(factor.natural(float(mode))),
            "low": float(factor.natural(float(mode - 1.96 * sd[k]))),
            "high": float(factor.natural(float(mode + 1.96 * sd[k]))),
            "prior_sd_left": left,
            "identified": left < 0.5,
            "at_bound": bool(abs(mode) > 1.14),
        }
    return out
