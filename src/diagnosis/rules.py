"""What changes a verdict after the scores have decided it, each rule once and in its order.

Before the runs of the gain (`after_scores`):
1. `as_laws`: a free law is a place and no name, so that `identified` becomes `discovered`;
2. `with_errors`: what no mechanism explains and an error of the set-up does becomes `error`, and a
   law that is not told from one gets it as a rival;
3. `with_untried`: what could not be tried, as its runs ended without a value where the tests did,
   makes a named cause `ambiguous`.
After them (`after_runs`):
4. `withdraw_refuted`: a mechanism can win the comparison and still be wrong, being only the best
   of those tried: what does not predict settings left out is withdrawn;
5. `undecided`: a base model that is called adequate, though the simulations could not have shown it
   wrong, is `not decided`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from calibration.figures import label
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import QUANTITIES
from diagnosis.catalogue import Mechanism
from diagnosis.extend import FIT
from diagnosis.identify import MISFIT, Identification
from diagnosis.page.words import in_unit, quantity
from diagnosis.set_up_errors import EVERY
from diagnosis.settings import BASE
from diagnosis.time_step import SURE

NAMED = ("identified", "discovered", "ambiguous")
"""Verdicts that name a law."""

FAR = 3.0
"""Error of the base model's emulator, or sure change by half the time step, over the error of the
readings, from which on an adequate base model is not decided."""


def after_scores(
    verdict: Mapping[str, Any],
    found: Identification,
    measurements: Sequence[Measurement],
    laws: Mapping[str, Mechanism],
    errors: Sequence[Mapping[str, Any]],
    catalogue: Mapping[str, Mechanism],
) -> dict[str, Any]:
    """The mapping of verdict.json of an `Identification`, with `outcomes`, by rules 1 to 3.

    laws: the free laws of `diagnosis.lever_laws`; errors: of the emulators, a row an experiment and
    mechanism."""
    verdict = with_errors(as_laws(dict(verdict), laws), found, measurements)
    return with_untried(verdict, errors, catalogue)


def after_runs(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json of emulated experiments by rules 4 and 5."""
    return undecided(withdraw_refuted(verdict))


def as_laws(verdict: dict[str, Any], laws: Mapping[str, Mechanism]) -> dict[str, Any]:
    """The mapping of verdict.json, where what it names are free laws: `discovered`, for a free law
    is a place and no name."""
    named = [n for cause in verdict["causes"] for n in cause.split(" + ")]
    if not named or not set(named) <= set(laws):
        return verdict
    changes = {"causes": []}  # type: ignore[var-annotated]
    if verdict["verdict"] == "identified":
        changes["verdict"] = "discovered"  # type: ignore[assignment]
    for row in verdict.get("laws") or []:
        row["sentence"] = " ".join(_told(verdict, laws[n]) for n in row["names"] if n in laws)
        row["names"] = [n for n in row["names"] if n not in laws]
    return verdict | changes


def _told(verdict, law):
    """A sentence on a law, with the change that was fitted."""
    text = law.description[:1].upper() + law.description[1:]
    fitted = next((r for r in verdict["ranking"] if r["mechanism"] == law.name), {})
    for s in fitted.get("strength", {}).values():
        text += f" by {s['value']:+.2g} (95 %: {s['low']:+.2g} to {s['high']:+.2g})"
    return f"{text}: {law.strength.name}."


def with_errors(
    verdict: Mapping[str, Any], found: Identification, measurements: Sequence[Measurement]
) -> dict[str, Any]:
    """The mapping of verdict.json of an `Identification`: `error` where an error of the set-up
    explains what no mechanism does; with the error as a rival of the laws that it is not told
    from."""
    if found.verdict != "unexplained" and not found.error:
        return dict(verdict)
    if found.error == EVERY:
        return _with_every_setting(verdict, found, measurements)
    return _with_single(verdict, found, measurements)


def _with_rival(verdict, rival):
    """The mapping with a rival of each law."""
    laws = [law | {"rivals": [*law["rivals"], rival]} for law in verdict["laws"]]
    return verdict | {"laws": laws}


def _with_every_setting(verdict, found, measurements):
    """Of the experiment that misfits most."""
    base = found.fits[BASE]
    worst = int(np.argmax(base.scale[0]))
    kind = measurements[worst].experiment
    own = [i for i, m in enumerate(measurements) if m.experiment == kind]
    more = np.sqrt(np.maximum(base.scale[0, own] ** 2 - 1.0, 0.0)) * base.sd[0, own]
    sd = float(np.median(more))
    row = {"experiment": kind, "of": "settings", "what": "settings", "sd": sd}
    row |= {"p": found.lack_of_fit_p, "rivals": []}
    row["sentence"] = (
        f"From setting to setting the {QUANTITIES[kind].words} scatters by "
        f"{in_unit(kind, sd, '.2g')} more than the errors of the readings say."
    )
    if found.verdict == "unexplained":
        return verdict | {"verdict": "error", "errors": [*verdict["errors"], row]}
    words = "an error of its own of each setting"
    return _with_rival(verdict, {"experiment": kind, "of": "settings", "words": words})


def _with_single(verdict, found, measurements):
    """The row, where the base model fits all others."""
    base = found.fits[BASE]
    off = (base.residual / np.sqrt(1.0 - base.leverage))[0]
    worst = int(np.argmax(np.abs(off)))
    # chi-square falls by so much when a setting is left out
    left = float(base.misfit[0] - off[worst] ** 2)
    if chi2.sf(left, max(float(base.freedom[0]) - 1.0, 1.0)) < MISFIT:
        return dict(verdict)
    m = measurements[worst]
    where = f"Line {m.line}" if m.line is not None else "A row"
    quantity = QUANTITIES[m.experiment]
    row = {"experiment": m.experiment, "line": m.line, "standard_deviations": float(off[worst])}
    row["sentence"] = (
        f"{where}: the {quantity.words} of {m.value:.4g} {quantity.unit}".rstrip()
        + f" lies {abs(off[worst]):.1f} standard deviations from what all others say, and alone "
        "explains the misfit."
    )
    if found.verdict == "unexplained":
        return verdict | {"verdict": "error", "rows": [row]}
    words = f"{where[:1].lower()}{where[1:]}"
    rival = {"experiment": m.experiment, "line": m.line, "words": words}
    return _with_rival(verdict, rival) | {"rows": [row]}


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


def withdraw_refuted(verdict: dict[str, Any]) -> dict[str, Any]:
    """The mapping of verdict.json after the engine's runs.

    Of single contacts a name is withdrawn where the interval of its gain lies below zero, or where
    levels that were left out are missed by more than FIT standard errors with it, errors of the
    refitted parameters among them: the verdict is then `discovered`, for the place stands. Where
    the interval of a law's gain holds zero the place is in doubt too: `ambiguous`.

    Of emulated experiments the verdict is `unexplained` then, or `error` where a single row was not
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
    causes = [c for c in verdict["causes"] if c not in withdrawn]
    changes = {"causes": causes, "best_tried": withdrawn} if withdrawn else {}
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


def _of_mechanisms(verdict):
    """See `withdraw_refuted`."""
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
    changes = {"verdict": "error" if verdict.get("rows") else "unexplained", "causes": []}
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
