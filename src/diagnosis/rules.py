"""The verdict: one of seven words with its causes and its reason, by tables of rules.

`BY_READINGS`: of what the model of the table places, the first rule that applies decides.
`OF_CONTACTS`, `OF_SIMULATED`: what the engine's runs say afterwards; each rule that applies puts
its verdict in the place of those that it names, in turn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from calibration.figures import label
from diagnosis.catalogue import Mechanism
from diagnosis.extend import FIT, SURE
from diagnosis.measurements import LEAST_SETTINGS
from diagnosis.page import words
from diagnosis.settings import BASE

NAMED = ("identified", "discovered", "ambiguous")
"""Verdicts that name a law."""

FAR = 3.0
"""Error of the base model's emulator, or sure change by half the time step, over the error of the
readings, from which on an adequate base model is not decided."""


@dataclass(frozen=True)
class Verdict:
    """Keys of verdict.json: the verdict, why, and the mechanisms that it names."""

    verdict: str
    reason: str
    causes: tuple[str, ...] = ()

    def keys(self) -> dict[str, Any]:
        """The keys of verdict.json."""
        return {"verdict": self.verdict, "reason": self.reason, "causes": list(self.causes)}


OPEN = Verdict("", "")
"""Before anything is judged."""


# --- by the readings ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Evidence:
    """What the readings say. laws, errors, rows: as in verdict.json; constant: whether constant
    coefficients meet the readings; scattered: whether what was found does, with errors from setting
    to setting; few: whether a law rests on fewer than LEAST_SETTINGS; bends: whether the readings
    follow a smooth curve along a lever."""

    laws: Sequence[Mapping[str, Any]]
    errors: Sequence[Mapping[str, Any]]
    rows: Sequence[Mapping[str, Any]]
    constant: bool
    scattered: bool
    few: bool
    bends: Callable[[], bool]

    @property
    def faults(self) -> list[Mapping[str, Any]]:
        """Errors of the set-up. What is declared is none, and what readings lose to rounding only
        where a constant does not fit without it."""
        known = ("declared", "digits") if self.constant else ("declared",)
        return [e for e in self.errors if e["what"] not in known]

    @property
    def placed(self) -> bool:
        """Return whether there is a law, a row or an error that has a place."""
        return bool(self.laws or self.rows or any(e["what"] != "settings" for e in self.faults))

    @property
    def faulty(self) -> bool:
        """Return whether errors or rows explain the misfit, and no law is placed."""
        return not self.laws and (self.placed or (bool(self.faults) and self.scattered))

    @property
    def open(self) -> bool:
        """Return whether a law or an error is not told from what stands beside it."""
        return any(map(_open, (*self.laws, *self.faults)))


BY_READINGS: tuple[tuple[str, str, Callable[[Evidence], bool]], ...] = (
    (
        "adequate",
        "constant coefficients meet the readings within their own errors",
        lambda e: e.constant and not e.placed and not e.faults,
    ),
    (
        "ambiguous",
        f"a law would rest on fewer than {LEAST_SETTINGS} settings, of which an error from one "
        "setting to the next is not told from a law",
        lambda e: e.few,
    ),
    (
        "ambiguous",
        "these data do not tell apart what stands under rivals",
        lambda e: e.open,
    ),
    (
        "unexplained",
        "the readings follow a curve along a lever that no mechanism and no error has",
        lambda e: e.faulty and not e.rows and e.bends(),
    ),
    (
        "error",
        "an error of the set-up or single rows explain the misfit, and laws do not",
        lambda e: e.faulty,
    ),
    (
        "unexplained",
        "constant coefficients do not meet the readings, nor does what was tried",
        lambda e: not e.placed,
    ),
    (
        "identified",
        "one mechanism of the catalogue is left in each place",
        lambda e: all(law["single"] for law in e.laws),
    ),
    (
        "discovered",
        "the place is known; no single mechanism is named",
        lambda e: True,
    ),
)
"""(a verdict, why, when it is given)."""


def by_readings(evidence: Evidence) -> Verdict:
    """The verdict of the first rule of BY_READINGS that applies."""
    verdict, reason = next((word, why) for word, why, holds in BY_READINGS if holds(evidence))
    names: list[str] = []
    if verdict == "identified":
        names = [law["single"] for law in evidence.laws]
    elif verdict == "ambiguous":
        names = [name for law in evidence.laws for name in law["names"]]
    return Verdict(verdict, reason, tuple(dict.fromkeys(names)))


def _open(row):
    """Return whether a law's place or an error is not told from another place or kind: of an error,
    from a law."""
    if "slot" in row:
        same = {(s["slot"], tuple(s["state"])) for s in row["same"]}
        return any((r.get("slot"), tuple(r.get("state", ()))) not in same for r in row["rivals"])
    return any("slot" in r for r in row["rivals"])


# --- by the engine's runs -----------------------------------------------------------------------


@dataclass(frozen=True)
class ByRuns:
    """The verdict that takes the place of others.

    because: why, of the mapping of verdict.json, empty where the rule does not apply; causes: what
    it then names, of the same mapping."""

    verdict: str
    instead_of: tuple[str, ...]
    because: Callable[[Mapping[str, Any]], str]
    causes: Callable[[Mapping[str, Any]], Sequence[str]] = lambda told: ()


def by_runs(told: Mapping[str, Any], rules: Sequence[ByRuns]) -> dict[str, Any]:
    """The mapping of verdict.json after each of the rules that applies, in turn.

    A law can win the comparison and still be wrong, being only the best of those tried: what does
    not predict settings left out is withdrawn. A base model that is called adequate, though the
    simulations could not have shown it wrong, is `not decided`."""
    out = dict(told)
    for rule in rules:
        reason = rule.because(out) if out["verdict"] in rule.instead_of else ""
        if reason:
            if rule.verdict in ("error", "unexplained"):
                out |= {"best_tried": _named(out) or out.get("extended_with"), "laws": []}
            causes = tuple(dict.fromkeys(rule.causes(out)))
            out |= Verdict(rule.verdict, reason, causes).keys()
    return out


def _against(gain):
    """Why a gain speaks against a name; empty where it does not."""
    if gain is None:
        return ""
    low, high = gain["held_out_rmse_difference_interval"]
    if high < 0.0:
        return f"the gain lies below zero ({low:.2f} to {high:.2f} standard errors)"
    missed = gain["held_out_rmse_after_all_errors"]
    return f"left-out levels are missed by {missed:.1f} standard errors" if missed > FIT else ""


def without_names(told: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping of single contacts, the names withdrawn from its laws that the engine's runs
    speak against: where the interval of a gain lies below zero, or where levels that were left out
    are missed by more than FIT standard errors, errors of the refitted parameters among them."""
    withdrawn: list[str] = []
    for law in told["laws"]:
        reason = _against(law.get("gain"))
        if reason and law["names"]:
            withdrawn += [n for n in law["names"] if n not in withdrawn]
            law |= {"withdrawn": law["names"], "names": [], "single": None}
            law["withdrawn_reason"] = reason
    causes = [c for c in told["causes"] if c not in withdrawn]
    return {**told, "causes": causes} | ({"best_tried": withdrawn} if withdrawn else {})


def _nameless(told):
    """Why a place stays whose name was withdrawn."""
    names = " and ".join(map(label, told.get("best_tried", ())))
    return names and f"the place is known; the engine with {names} does not predict left-out levels"


def _idle(told):
    """Why a place is in doubt: the gain of its law may be none."""
    gains = [law["gain"] for law in told["laws"] if law.get("gain") and not law.get("withdrawn")]
    for low, high in (gain["held_out_rmse_difference_interval"] for gain in gains):
        if low <= 0.0:
            return (
                "left-out levels are not shown to be predicted better with a law than without it "
                f"(gain {low:.2f} to {high:.2f} standard errors)"
            )
    return ""


def with_untried(
    told: Mapping[str, Any],
    errors: Sequence[Mapping[str, Any]],
    catalogue: Mapping[str, Mechanism],
) -> dict[str, Any]:
    """The mapping of simulated tests with what could not be tried, a rival of the strongest law.

    An emulator needs runs with a value. A mechanism without one counts as without effect on the
    tests that ended without a value, although it ended all of its own runs so. Where such tests are
    what is wrong, it stands beside the causes.

    errors: of the emulators, a row an experiment and mechanism; catalogue: {name: Mechanism}.
    """
    misfit = told["misfit"]
    wrong = (misfit.get("deviance") or 0.0) > misfit["chi_square"]
    ended = {row["experiment"] for row in told["outcomes"] if row["failed"]}
    untried = [
        {"experiment": row["experiment"], "mechanism": row["mechanism"], "runs": row["failed"]}
        for row in errors
        if row["experiment"] in ended and row["mechanism"] != BASE and not row["runs"]
    ]
    if not wrong or told["verdict"] == "adequate":
        return {**told, "untried": []}
    laws = [dict(law) for law in told["laws"]]
    for law in laws[:1]:
        law["rivals"] = [*law["rivals"]]
        for row in untried:
            slot, state = catalogue[row["mechanism"]].law or (row["mechanism"], ())
            place = {"experiment": row["experiment"], "slot": slot, "state": list(state)}
            law["rivals"].append(place | {"words": row["mechanism"]})
    return {**told, "untried": untried, "laws": laws}


def _named(told):
    """Return what is named, and what could not be tried beside it."""
    named = told["causes"] or [name for law in told.get("laws", ()) for name in law["names"]]
    untried = [row["mechanism"] for row in told.get("untried", ())]
    return [*named, *(name for name in untried if name not in named)]


def _not_tried(told):
    """Why what could not be tried is not told from the cause."""
    names = " and ".join(label(row["mechanism"]) for row in told.get("untried", ()))
    return names and f"{names} ended without a value as the tests did, and could not be tried"


def _missed(told):
    """Why the engine's runs speak against what was named: settings left out are missed with it, or
    have no value at all."""
    gain, run = told.get("gain"), told.get("extended_with", [])
    if not (gain or run):
        return ""
    against = _against(gain) if gain else "it gives no value at any setting that was left out"
    if not against:
        return ""
    tried = _named(told) or run
    run = run or tried
    others = [name for name in tried if name not in run]
    before = told["verdict"]
    return words.told("missed.j2", run=run, others=others, against=against, before=before)


def _unchecked(told):
    """Return what would decide whether the base model is adequate, where a check of the simulations
    fails by FAR."""
    rough = [r for r in told["refinement"]["left"] if r["mechanism"] == BASE and r["error"] > FAR]
    steps = [
        r
        for r in told.get("time_step") or ()
        if abs(r["change"]) - SURE * r["uncertain"] > FAR * r["error"]
    ]
    return words.told("unchecked.j2", rough=rough, steps=steps)


OF_CONTACTS = (
    ByRuns("discovered", ("identified",), _nameless),
    ByRuns("ambiguous", ("identified", "discovered"), _idle, lambda told: told["causes"]),
)
"""Rules of single contacts, whose laws keep their place when a name is withdrawn."""

OF_SIMULATED = (
    ByRuns("ambiguous", NAMED, _not_tried, _named),
    ByRuns("error", NAMED, lambda told: _missed(told) if told.get("rows") else ""),
    ByRuns("unexplained", NAMED, _missed),
    ByRuns("not decided", ("adequate",), _unchecked),
)
"""Rules of simulated tests."""
