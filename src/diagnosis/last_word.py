"""The engine's last word on a verdict: what is named must also predict settings left out.

A mechanism can win the comparison and still be wrong: it was only the best of those tried.
"""

from calibration.figures import label

FIT = 3.0
"""Root mean square miss at left-out settings, in standard errors, above which nothing is named."""

NAMING = ("identified", "ambiguous")


def last_word(verdict):
    """The mapping of verdict.json: `unexplained` where the engine with what is named misses
    settings that were left out by more than `FIT` standard errors. `best_tried` then holds what had
    been named.

    A law of single contacts has its own test of left-out levels (`diagnosis.laws`).
    """
    gain = verdict.get("gain")
    miss = gain["held_out_rmse_after"] if gain else 0.0
    if verdict["verdict"] not in NAMING or miss <= FIT:
        return verdict
    tried = verdict["causes"]
    reason = (
        f"best of those tried, does not fit: with {' or '.join(label(name) for name in tried)} "
        f"the engine still misses settings that were left out by {miss:.1f} standard errors (root "
        f"mean square), where {FIT:g} are the most that count as a fit; by the emulators alone the "
        f"verdict was {verdict['verdict']}"
    )
    changes = {"verdict": "unexplained", "causes": [], "best_tried": tried, "reason": reason}
    return verdict | changes
