"""What softening the grains changes at full scale, in words, from the study of the numerics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

if TYPE_CHECKING:
    import pandas as pd


STIFFER = "full scale, shear modulus 10 MPa"


def softening(table: pd.DataFrame) -> str:
    """What softening the grains to 3 MPa changes at full scale, in sentences: at each point, and
    over all of them with Welch's 95 % interval."""
    stiff = table[table["variant"] == STIFFER]
    soft = (
        table[table["variant"] == stiff["against"].iloc[0]].set_index("point").loc[stiff["point"]]
    )
    parts = np.concatenate([t["sd"] ** 2 / t["n"] for t in (stiff, soft)]) / len(stiff) ** 2
    counts = np.concatenate([stiff["n"], soft["n"]])
    freedom = parts.sum() ** 2 / (parts**2 / (counts - 1)).sum()
    half = stats.t.ppf(0.975, freedom) * np.sqrt(parts.sum())
    each = ", ".join(
        f"{r.difference:+.2f}° ({r.low:+.2f} to {r.high:+.2f}) at {r.point}"
        for r in stiff.itertuples()
    )
    mean = stiff["difference"].mean()
    shown = abs(mean) > half
    advice = (
        "Correct an angle by this where it is to stand for 10 MPa."
        if shown
        else "So no change is shown."
    )
    return (
        f"With 10 MPa in place of 3 MPa the angle at full scale changes by {each}. On average it "
        f"changes by {mean:+.2f}° ({mean - half:+.2f} to {mean + half:+.2f}). All intervals are of "
        f"95 %. {advice}"
    )
