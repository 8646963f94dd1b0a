"""What the engine's runs withdraw: a name that does not predict settings left out, and a base model
that is called adequate though the simulations could not have shown it wrong.

A mechanism can win the comparison and still be wrong: it was only the best of those tried.
"""

from typing import Any

from calibration.figures import label
from diagnosis.extend import FIT
from diagnosis.page.words import in_unit, quantity
from diagnosis.settings import BASE
from diagnosis.time_step import SURE

NAMING = ("identified", "discovered", "ambiguous")

FAR = 3.0
"""Error of the base model's emulator, or sure change by half the time step, over the error of the
readings, from which on an adequate base model is not decided."""


def undecided(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json of emulated experiments: `not decided` in place of `adequate`
    where a check of the simulations fails by FAR, with what would decide it as its reason."""
    if verdict["verdict"] != "adequate":
        return verdict
    told = [
        f"the simulations' own error is {r['error']:.2g} times the readings' "
        f"({quantity(r['experiment'])}), which more runs lessen"
        for r in verdict["refinement"]["left"]
        if r["mechanism"] == BASE and r["error"] > FAR
    ]
    told += [
        f"half the time step moves the {quantity(r['experiment'])} by "
        f"{in_unit(r['experiment'], r['change'], '+.2g')}, {abs(r['change'] / r['error']):.2g} "
        "times the reading's error, which a finer step (`numerics`) decides"
        for r in verdict.get("time_step") or ()
        if abs(r["change"]) - SURE * r["uncertain"] > FAR * r["error"]
    ]
    return verdict | {"verdict": "not decided", "reason": "; ".join(told)} if told else verdict


def withdraw_refuted(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json after the engine's runs.

    Of single contacts a name is withdrawn where the interval of its gain lies below zero, or where
    levels that were left out are missed by more than FIT standard errors with it, errors of the
    refitted parameters among them: the verdict is then `discovered`, for the place stands. Of
    emulated experiments the verdict is `unexplained` then, or `error` where a single row was not
    told from the law, and so where the engine with what is named gives no value at any setting left
    out; `best_tried` then holds what had been named."""
    if any("evidence" in law for law in verdict.get("laws") or []):
        return _of_laws(verdict)
    return _of_mechanisms(verdict)


def _of_laws(verdict):
    """See `withdraw_refuted`."""
    withdrawn = []
    for law in verdict["laws"]:
        reason = _against(law.get("gain"))
        if reason and law["names"]:
            withdrawn += [n for n in law["names"] if n not in withdrawn]
            law |= {"withdrawn": law["names"], "names": [], "single": None}
            law["withdrawn_reason"] = reason
    if not withdrawn:
        return verdict
    causes = [c for c in verdict["causes"] if c not in withdrawn]
    changes = {"causes": causes, "best_tried": withdrawn}
    if verdict["verdict"] == "identified":
        words = " and ".join(map(label, withdrawn))
        changes |= {"verdict": "discovered", "causes": []}
        changes["reason"] = (
            f"the place is known; the engine with {words} does not predict left-out levels"
        )
    return verdict | changes


def _against(gain):
    """Why a gain speaks against a name, or None."""
    if gain is None:
        return None
    low, high = gain["held_out_rmse_difference_interval"]
    if high < 0.0:
        return f"the gain lies below zero ({low:.2f} to {high:.2f} standard errors)"
    missed = gain["held_out_rmse_after_all_errors"]
    if missed > FIT:
        return f"left-out levels are missed by {missed:.1f} standard errors"
    return None


def _of_mechanisms(verdict):
    """See `withdraw_refuted`."""
    gain, run = verdict.get("gain"), verdict.get("extended_with", [])
    if verdict["verdict"] not in NAMING or not (gain or run):
        return verdict
    against = _against(gain) if gain else "it gives no value at any setting that was left out"
    if not against:
        return verdict
    placed = [n for law in verdict.get("laws") or [] for n in law["names"]]
    tried = verdict["causes"] or placed or run
    run = run or tried
    others = [label(name) for name in tried if name not in run]
    reason = (
        f"best of those tried, does not fit by the engine's runs with "
        f"{' and '.join(map(label, run))}: {against}; by the emulators alone the verdict was "
        f"{verdict['verdict']}"
    )
    if others:
        reason += f", and {' and '.join(others)}, not told apart from it, was not run"
    changes = {"verdict": "error" if verdict.get("rows") else "unexplained", "causes": []}
    changes |= {"best_tried": tried, "reason": reason}
    return verdict | changes | ({"laws": []} if "laws" in verdict else {})
