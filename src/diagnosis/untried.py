"""Mechanisms that could not be tried, as their runs ended without a value: where the tests ended so
too, none of them is ruled out."""

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.catalogue import Mechanism
from diagnosis.settings import BASE

NAMED = ("identified", "discovered", "ambiguous")


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
