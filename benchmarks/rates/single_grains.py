"""Effects hidden in drops and slides of the engine, diagnosed as such tables are: by free laws and
the integrated contact.

Data are drawn by `hidden` at the strengths in STRENGTHS: each moves one setting of the plan by ten
standard errors.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import pandas as pd

from benchmarks.rates import hidden
from benchmarks.rates.kept_rates import KEPT, ROOT, Trial, shares
from benchmarks.rates.simulated import rate_settings, salt_heap
from diagnosis import contacts
from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of

STRENGTHS = KEPT / "strengths.csv"
POINTS, FIRST = 4, 1000
"""Points in the space of the parameters, and the first of them and of the seeds: those below were
looked at while the method was made."""

KINDS = ("no effect", "mechanism", "removed")
VERDICTS = ("adequate", "identified", "discovered", "ambiguous", "error", "unexplained")


@dataclass(frozen=True)
class Case:
    """A table: what is hidden in it, at which point, and the seed of its noise. `removed`: what is
    hidden is taken out of the catalogue."""

    case: str
    truth: str
    point: int
    seed: int


def planned() -> list[Case]:
    """Return the nulls, and each mechanism in the catalogue and taken out of it; point after point,
    so that a part of them is a fair one."""
    own = [Case(KINDS[0], "", FIRST + seed % 8, FIRST + seed) for seed in range(40)]
    own += [
        Case(kind, name, FIRST + point, FIRST + 100 + point)
        for name in strengths()
        for point in range(POINTS)
        for kind in KINDS[1:]
    ]
    own = [c for c in own if c.point < FIRST + POINTS]
    return sorted(own, key=lambda c: (c.point, c.seed, c.truth, c.case))


def strengths() -> dict[str, float]:
    """Return {mechanism: strength in its unit}: the weakest that moves a setting of the plan by ten
    standard errors beyond what the base model takes up."""
    kept = pd.read_csv(STRENGTHS)
    return dict(zip(kept["mechanism"], kept["strength"], strict=True))


@cache
def study() -> tuple[Rig, dict]:
    """Return rig and catalogue."""
    base = salt_heap()
    settings = rate_settings()
    factors = parameters_of(settings, ROOT / "config/factors.tsv", ["drop", "tilt"])
    return Rig(settings, base, tuple(factors)), load_catalogue()


@cache
def measured(truth: str, point: int, seed: int) -> list:
    """Return the measurements of a case; those of `mechanism` and `removed` are the same."""
    effects = {truth: strengths()[truth]} if truth else {}
    return hidden.draw(point, *study(), effects, seed)


def judged(case: Case) -> dict[str, Any]:
    """Return the row of a case."""
    rig, known = study()
    catalogue = {n: m for n, m in known.items() if case.case != "removed" or n != case.truth}
    found = contacts.discovered(measured(case.truth, case.point, case.seed), rig, catalogue)
    assert found is not None  # drops and slides are judged by free laws
    law = found.law
    leads = (law["slot"], tuple(law["state"])) if law else None
    names = found.causes if found.verdict == "identified" else []
    right = bool(case.truth) and names == [case.truth]
    return {
        "case": case.case,
        "truth": case.truth,
        "seed": case.seed,
        "verdict": found.verdict,
        "causes": " + ".join(found.causes),
        "slot": law["slot"] if law else "",
        "state": " x ".join(law["state"]) if law else "",
        "right_law": int(bool(case.truth) and leads == known[case.truth].law),
        "right_name": int(right),
        "wrong_name": int(bool(names) and (not right or case.case == "removed")),
        "p": round(found.p, 4),
    }


def told(rows: pd.DataFrame) -> Iterator[str]:
    """Yield lines of Markdown: the rates, the verdicts, the mechanisms one by one."""
    null, full, out = (rows[rows["case"] == k] for k in KINDS)
    yield from shares(
        (
            ("no effect: adequate", null["verdict"] == "adequate"),
            ("no effect: no law claimed", ~null["verdict"].isin(["identified", "discovered"])),
            ("a mechanism: slot and state of the law that leads are its own", full["right_law"]),
            ("a mechanism: identified and right", full["right_name"]),
            ("a mechanism: identified and wrong", full["wrong_name"]),
            ("taken out of the catalogue: slot and state are its own", out["right_law"]),
            ("taken out of the catalogue: identified", out["verdict"] == "identified"),
        )
    )
    yield from ("", "| | " + " | ".join(VERDICTS) + " |", "|---|" + "---|" * len(VERDICTS))
    words = ("no effect", "a mechanism", "taken out of the catalogue")
    for name, group in zip(words, (null, full, out), strict=True):
        count = [str(int((group["verdict"] == v).sum())) for v in VERDICTS]
        yield f"| {name} | " + " | ".join(count) + " |"
    yield from ("", "| hidden | identified and right | slot and state are its own | verdicts |")
    yield "|---|---|---|---|"
    for name, own in full.groupby("truth"):
        verdicts = ", ".join(f"{n} {v}" for v, n in own["verdict"].value_counts().items())
        yield (
            f"| {name.replace('_', ' ')} | {own['right_name'].sum()} of {len(own)} "
            f"| {own['right_law'].sum()} of {len(own)} | {verdicts} |"
        )


TRIAL = Trial(
    "single grains", KEPT / "single_grains.csv", "contacts", planned,
    lambda case: {"case": case.case, "truth": case.truth, "seed": case.seed}, judged, told,
)  # fmt: skip
