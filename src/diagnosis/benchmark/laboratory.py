"""A data set with a hidden effect, drawn by the engine, diagnosed, and the verdict judged."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from diagnosis.benchmark import effect, hidden
from diagnosis.catalogue import load_catalogue
from diagnosis.identify import decide, weigh
from diagnosis.verdict import findings

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.intake.measurements import Measurement
    from diagnosis.identify import Identification, Scores
    from diagnosis.model import Emulated
    from diagnosis.rig import Rig


DECOYS = {"outlier": hidden.outlier, "understated": hidden.understated}
"""Data without an effect that look as if there were one: how they are made of good ones and a
seed."""


@dataclass(frozen=True)
class Case:
    """One data set to diagnose; `point` decides its base parameters, `seed` its noise, `bench` what
    is measured.

    strength: size of each effect over that of a moderate one (`effect.MODERATE`).
    """

    case: str
    effects: tuple
    strength: float
    seed: int
    point: int
    bench: str = "grains"

    @property
    def truth(self) -> str:
        """Names of what is hidden."""
        return " + ".join(self.effects)


class Laboratory:
    """Draws data of the engine and diagnoses them; holds what all cases share."""

    def __init__(
        self,
        emulated: Emulated,
        rig: Rig,
        replicates: int,
        root: str | Path | None = None,
        plans: Mapping[str, Sequence[tuple[str, dict]]] = hidden.PLANS,
    ) -> None:
        self.emulated, self.rig = emulated, rig
        self.replicates, self.root, self.plans = replicates, root, plans
        self._last = None, None
        self._strengths = {}  # type: ignore[var-annotated]

    def plan(self, case: Case) -> Sequence[tuple[str, dict]]:
        """What is measured of a case at first: little of one that this little is not to decide."""
        if case.case != "undecided":
            return self.plans[case.bench]
        [plan] = [
            plan
            for pair, (bench, plan) in hidden.ALIKE.items()
            if case.effects[0] in pair and bench == case.bench
        ]
        return plan

    def strength(self, case: Case, name: str) -> tuple[float, float]:
        """(strength in its unit, size) of an effect whose size on the case's plan is that share of
        a moderate one."""
        plan = self.plan(case)
        key = repr(plan), name, case.strength
        if key not in self._strengths:
            self._strengths[key] = effect.strength_at(
                self.emulated, plan, name, case.strength * effect.MODERATE
            )
        return self._strengths[key]

    def measure(
        self, case: Case, conditions: Sequence[tuple[str, dict]] | None = None
    ) -> list[Measurement]:
        """Measurements of a case under the given conditions, those of its plan unless given."""
        measured, _ = hidden.draw(
            case.point,
            self.rig,
            load_catalogue(),
            {n: self.strength(case, n)[0] for n in case.effects},
            case.seed,
            conditions or self.plan(case),
            self.root,
        )
        return measured

    def weigh(self, measured: Sequence[Measurement], seed: int) -> Scores:
        """`Scores` of the measurements."""
        return weigh(self.emulated, measured, self.replicates, seed)

    def identify(
        self, measured: Sequence[Measurement], seed: int, without: Collection[str] = ()
    ) -> Identification:
        """`Identification` with some mechanisms taken out of the catalogue."""
        return decide(self.weigh(measured, seed), self.emulated.settings.alpha, without)

    def diagnose(self, case: Case) -> dict[str, Any]:
        """A mapping: the case, the verdict, and whether the truth was named."""
        if case.case == "undecided":
            return self.resolve(case)
        without = case.effects if case.case == "removed" else ()
        row = judge(case, decide(self._scores(case), self.emulated.settings.alpha, without))
        return row | self._hidden(case)

    def _hidden(self, case):
        """Strengths of what is hidden in a case, as text, and the size of the larger."""
        found = [self.strength(case, n) for n in case.effects]
        units = [self.emulated.catalogue[n].strength.unit for n in case.effects]
        strengths = [f"{s:.3g} {u}" for (s, _), u in zip(found, units, strict=True)]
        size = max((s for _, s in found), default=0.0)
        return {"hidden": " + ".join(strengths), "size": round(size, 2)}

    def _scores(self, case):
        """Scores of a case. Those of the last data set are kept, because it may come again with a
        smaller catalogue."""
        data = replace(case, case=case.case if case.case in DECOYS else "")
        if self._last[0] != data:
            measured = self.measure(case)
            if case.case in DECOYS:
                measured = DECOYS[case.case](measured, case.seed)
            self._last = data, self.weigh(measured, case.seed)
        return self._last[1]

    def resolve(self, case: Case, further: int = 2) -> dict[str, Any]:
        """Diagnose too little data, add the measurement that the diagnosis asks for, up to
        `further` times."""
        measured = self.measure(case)
        found = self.identify(measured, case.seed)
        row = judge(case, found) | self._hidden(case)
        for k in range(1, further + 1):
            valued = [m for m in measured if not m.outcome]
            proposal = findings(self.emulated, valued, found)["next_measurement"]
            if proposal and found.verdict == "ambiguous":
                levers = {n: v for n, v in proposal["levers"].items() if v is not None}
                # read anew, were it at a setting that has been measured before
                again = replace(case, seed=case.seed + 10_000 * k)
                measured = measured + self.measure(again, [(proposal["experiment"], levers)])
                found = self.identify(measured, case.seed)
            row[f"outcome_{k}_further"] = judge(case, found)["outcome"]
        return row


def judge(case: Case, found: Identification) -> dict[str, Any]:
    """Compare a verdict with the truth."""
    first = found.ranking[0]["mechanism"]
    named = found.verdict in ("identified", "discovered", "ambiguous")
    outcome = " + ".join(found.causes) if found.verdict == "identified" else found.verdict
    if set(found.causes) == set(case.effects) and found.verdict == "identified":
        outcome = case.truth
    return {
        "case": case.case,
        "truth": case.truth,
        "strength": case.strength,
        "seed": case.seed,
        "point": case.point,
        "bench": case.bench,
        "verdict": found.verdict,
        "causes": " + ".join(found.causes),
        "first": first if named else "",
        "named_first": named and set(first.split(" + ")) == set(case.effects),
        "among_causes": bool(case.effects) and set(case.effects) <= set(found.causes),
        "outcome": outcome,
        "lack_of_fit_p": found.lack_of_fit_p,
        "family_p": found.family_p,
        "gain": found.ranking[0]["gain"],
    }
