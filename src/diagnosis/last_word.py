"""The engine's last word on a verdict: what is named must also predict settings left out.

A mechanism can win the comparison and still be wrong: it was only the best of those tried.
"""

import numpy as np

from calibration.figures import label

FIT = 3.0
"""Root mean square miss at left-out settings, in standard errors, above which nothing is named."""

NAMING = ("identified", "discovered", "ambiguous")


def last_word(verdict):
    """The mapping of verdict.json: `unexplained` where the engine with what is named misses
    settings that were left out by more than `FIT` standard errors, or gives no value at any of
    them. `best_tried` then holds what had been named.

    A law of single contacts has its own test of left-out levels (`diagnosis.laws`).
    """
    gain, run = verdict.get("gain"), verdict.get("extended_with", [])
    if verdict["verdict"] not in NAMING or verdict.get("law") or not (gain or run):
        return verdict
    miss = gain["held_out_rmse_after"] if gain else np.inf
    if miss <= FIT:
        return verdict
    tried = verdict["causes"]
    beyond = (
        f"still misses settings that were left out by {miss:.1f} standard errors (root mean "
        f"square), where {FIT:g} are the most that count as a fit"
        if gain
        else "gives no value at any setting that was left out"
    )
    run = run or tried
    others = [label(name) for name in tried if name not in run]
    reason = (
        f"best of those tried, does not fit: with {' and '.join(map(label, run))} the engine "
        f"{beyond}; by the emulators alone the verdict was {verdict['verdict']}"
    )
    if others:
        reason += f", and {' and '.join(others)}, not told apart from it, was not run"
    changes = {"verdict": "unexplained", "causes": [], "best_tried": tried, "reason": reason}
    return verdict | changes
