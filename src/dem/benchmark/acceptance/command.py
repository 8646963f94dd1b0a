"""`dem accept`: both engines make the trials side by side, a line tells how far they are, and a
table the verdicts."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING, Any

from dem.benchmark.acceptance.judge import DIFFERENT, judge
from dem.benchmark.acceptance.runs import Engine, closed_forms
from dem.benchmark.acceptance.trials import TRIALS

if TYPE_CHECKING:
    from pathlib import Path


def accept(old: str, new: str, out: Path, seeds: int) -> bool:
    """Compare two engines, each a checkout or a git revision; runs are kept in `out`, where a
    comparison that was cut off goes on. Returns whether NEW may take OLD's place."""
    engines = [Engine(given, out) for given in (old, new)]
    try:
        names = [engine.fingerprint() for engine in engines]
        print(f"old: {old}, engine {names[0]}\nnew: {new}, engine {names[1]}", flush=True)
        if names[0] == names[1]:
            print("one engine: every run is the same")
        values, seconds = _values(engines, seeds)
    finally:
        for engine in engines:
            engine.close()
    hold, said = closed_forms(engines[1], names[1], out)
    print(f"closed forms (tests/verification of {new}): {'hold' if hold else 'FAIL'}: {said}")
    verdicts = {
        trial.name: judge(*values[trial.name], trial.margin, trial.relative, len(TRIALS))  # type: ignore[call-arg]
        for trial in TRIALS
    }
    print(table(verdicts, seeds))
    total = " and ".join(f"{sum(s):.0f} s" for s in seconds)
    print(f"The runs took {total} of a core, old and new.")
    accepted = hold and all(v.accepted for v in verdicts.values())
    print("accepted" if accepted else "REFUSED")
    return accepted


def _values(engines, seeds):
    """({trial: (old, new)}, lists of values by seed, nan without one; wall times [s] of each)."""
    asked = [(trial, seed) for trial in TRIALS for seed in range(1, seeds + 1)]
    for trial, seed in asked:
        for engine in engines:
            name = f"{trial.name.replace(', ', '-').replace(' ', '_')}-{seed}"
            engine.ask(name, trial.spec(seed), trial.metric)
    values = {trial.name: ([], []) for trial in TRIALS}
    seconds, begin = ([], []), time.monotonic()
    for done, (trial, seed) in enumerate(asked, 1):
        for side, engine in enumerate(engines):
            found = engine.answer()
            values[trial.name][side].append(found.get("value", math.nan))
            seconds[side].append(found.get("seconds", 0.0))
            if "lost" in found:
                given = engine.given
                print(
                    f"\n{trial.name}, seed {seed}, {given}: no value: {found['lost']}", flush=True
                )
        spent = time.monotonic() - begin
        left = spent / done * (len(asked) - done) / 60
        print(f"\r{done} of {len(asked)} pairs, {trial.name}; about {left:.0f} min left   ",
              end="", file=sys.stderr, flush=True)  # fmt: skip
    print(file=sys.stderr)
    return values, seconds


def table(verdicts: Any, seeds: int) -> str:
    """The verdicts as lines of text."""
    head = ("trial", "pairs", "old", "new", "difference", "margin", "verdict")
    rows = [head]
    for name, v in verdicts.items():
        apart = f"{v.difference:+.4g} ± {v.half:.2g}"
        lost = "" if v.pairs == seeds else f" (alone without a value: {v.lost[0]}, {v.lost[1]})"
        cells = (f"{v.old:.5g}", f"{v.new:.5g}", apart, f"{v.margin:.2g}")
        rows.append((name, str(v.pairs), *cells, v.outcome + lost))
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    worst = [name for name, v in verdicts.items() if v.outcome == DIFFERENT]
    lines.append(
        f"Intervals hold together with 95 %. Apart: {', '.join(worst) if worst else 'none'}."
    )
    return "\n".join(lines)
