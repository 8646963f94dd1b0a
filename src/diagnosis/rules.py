"""What changes a verdict after the readings have decided it (`diagnosis.table_model.found`), each
rule once and in its order.

Before the runs of the gain:
1. `with_untried`: what could not be tried, as its runs ended without a value where the tests did,
   makes a named cause `ambiguous`.
After them:
2. `withdraw_laws` of single contacts, `withdraw_mechanisms` of simulated tests: a law can win the
   comparison and still be wrong, being only the best of those tried: what does not predict settings
   left out is withdrawn;
3. `undecided`: a base model that is called adequate, though the simulations could not have shown it
   wrong, is `not decided`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from calibration.figures import label
from diagnosis.catalogue import Mechanism
from diagnosis.extend import FIT
from diagnosis.page.words import in_unit, quantity
from diagnosis.settings import BASE
from diagnosis.time_step import SURE
from diagnosis.verdict import NAMED

FAR = 3.0
"""Error of the base model's emulator, or sure change by half the time step, over the error of the
readings, from which on an adequate base model is not decided."""


def with_untried(
    verdict: Mapping[str, Any],
    errors: Sequence[Mapping[str, Any]],
    catalogue: Mapping[str, Mechanism],
) -> dict[str, Any]:
    """The mapping of verdict.json, whose cause is not told from what could not be tried.

    An emulator needs runs with a value. A mechanism without one counts as without effect on the
    tests that ended without a value, although it ended all of its own runs so. Where such tests are
    what is wrong, it stands beside the causes, and the verdict is `ambiguous`.

    errors: of the emulators, a row an experiment and mechanism; catalogue: {name: Mechanism}.
    """
    misfit = verdict["misfit"]
    wrong = (misfit.get("deviance") or 0.0) > misfit["chi_square"]
    ended = {row["experiment"] for row in verdict["outcomes"] if row["failed"]}
    untried = [
        {"experiment": row["experiment"], "mechanism": row["mechanism"], "runs": row["failed"]}
        for row in errors
        if row["experiment"] in ended and row["mechanism"] != BASE and not row["runs"]
    ]
    if not (wrong and untried) or verdict["verdict"] == "adequate":
        return {**verdict, "untried": []}
    found = {**verdict, "untried": untried}
    if verdict["verdict"] not in NAMED:
        return found
    laws = [dict(law) for law in verdict["laws"]]
    told = verdict["causes"] or [name for law in laws for name in law["names"]]
    for law in laws[:1]:
        law["rivals"] = [*law["rivals"], *(_rival(row, catalogue) for row in untried)]
    return found | {
        "verdict": "ambiguous",
        "causes": list(dict.fromkeys([*told, *(row["mechanism"] for row in untried)])),
        "laws": laws,
    }


def _rival(row, catalogue):
    slot, state = catalogue[row["mechanism"]].law or (row["mechanism"], ())
    place = {"experiment": row["experiment"], "slot": slot, "state": list(state)}
    return place | {"words": row["mechanism"]}


def withdraw_laws(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json of single contacts after the engine's word.

    A name is withdrawn where the interval of its gain lies below zero, or where levels that were
    left out are missed by more than FIT standard errors with it, errors of the refitted parameters
    among them: the verdict is then `discovered`, for the place stands. Where the interval of a
    law's gain holds zero the place is in doubt too: `ambiguous`."""
    withdrawn = []  # type: ignore[var-annotated]
    for law in verdict["laws"]:
        reason = _against(law.get("gain"))
        if reason and law["names"]:
            withdrawn += [n for n in law["names"] if n not in withdrawn]
            law |= {"withdrawn": law["names"], "names": [], "single": None}
            law["withdrawn_reason"] = reason
    causes = [c for c in verdict["causes"] if c not in withdrawn]
    changes: dict[str, Any] = {"causes": causes, "best_tried": withdrawn} if withdrawn else {}
    if withdrawn and verdict["verdict"] == "identified":
        words = " and ".join(map(label, withdrawn))
        changes |= {"verdict": "discovered", "causes": []}
        changes["reason"] = (
            f"the place is known; the engine with {words} does not predict left-out levels"
        )
    return _in_doubt(verdict | changes)


def _in_doubt(verdict):
    """The mapping with `ambiguous` where a law is placed whose gain may be none."""
    ends = [law["gain"]["held_out_rmse_difference_interval"] for law in verdict["laws"]
            if law.get("gain") and not law.get("withdrawn")]  # fmt: skip
    idle = [end for end in ends if end[0] <= 0.0]
    if not idle or verdict["verdict"] not in ("identified", "discovered"):
        return verdict
    low, high = idle[0]
    reason = (
        "left-out levels are not shown to be predicted better with a law than without it (gain "
        f"{low:.2f} to {high:.2f} standard errors)"
    )
    return verdict | {"verdict": "ambiguous", "reason": reason}


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


def withdraw_mechanisms(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json of simulated tests after the engine's runs: `unexplained` where
    they speak against what is named, or `error` where a single row was not told from the law, and
    so where the engine with what is named gives no value at any setting left out; `best_tried` then
    holds what had been named."""
    gain, run = verdict.get("gain"), verdict.get("extended_with", [])
    if verdict["verdict"] not in NAMED or not (gain or run):
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
    changes: dict[str, Any] = {
        "verdict": "error" if verdict.get("rows") else "unexplained",
        "causes": [],
    }
    changes |= {"best_tried": tried, "reason": reason}
    return verdict | changes | ({"laws": []} if "laws" in verdict else {})


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
