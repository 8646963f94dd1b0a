"""The benchmark's cases on single grains, diagnosed as drops and slides are: by free laws and the
integrated contact, in place of emulators.

    python tests/discovery/single_grains.py diagnose   goes on where it was cut off
    python tests/discovery/single_grains.py table      writes the table into the documentation

Data are drawn by the engine as the benchmark draws them, at the strengths in STRENGTHS. A case that
has been diagnosed stands in KEPT with the engine and the rules that did it; of others it is
diagnosed anew.
"""

import sys
import time
from datetime import date
from pathlib import Path

import kept_rates
import pandas as pd
import yaml

from diagnosis import contacts
from diagnosis.benchmark import hidden
from diagnosis.benchmark.kept import append, share
from diagnosis.benchmark.study import cases
from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of, read_settings

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "results/reference/discovery"
KEPT, STRENGTHS = FOLDER / "single_grains.csv", FOLDER / "strengths.csv"
PAGE = ROOT / "results/reference/discovery/rates.md"
MARK = "single grains"
POINTS = 4
"""Of the benchmark's eight: what a core does in a quarter of an hour."""

KINDS = ("no effect", "mechanism", "removed")
VERDICTS = ("adequate", "identified", "discovered", "ambiguous", "error", "unexplained")
COMMAND = "python tests/discovery/single_grains.py diagnose"
KEY = ["case", "truth", "seed"]


def planned():
    """The nulls at the first points, and there each mechanism at its moderate strength, in the
    catalogue and taken out of it; point after point, so that a part of them is a fair one."""
    own = [
        c for c in cases() if c.bench == "grains" and c.case in KINDS and c.strength in (0.0, 1.0)
    ]
    points = sorted({c.point for c in own})[:POINTS]
    own = [c for c in own if c.point in points]
    return sorted(own, key=lambda c: (c.point, c.seed, c.truth, c.case))


def strengths():
    """{mechanism: strength}: the weakest that moves a setting of the plan by ten standard errors,
    as the benchmark's emulators had it."""
    kept = pd.read_csv(STRENGTHS)
    return dict(zip(kept["mechanism"], kept["strength"], strict=True))


def study():
    """Rig and catalogue of the benchmark."""
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())["run"]
    settings = read_settings(ROOT / "config/discovery.yaml")
    factors = parameters_of(settings, ROOT / "config/factors.tsv", ["drop", "tilt"])
    return Rig(settings, base, tuple(factors)), load_catalogue()


def judged(case, found, known):
    """A row of KEPT."""
    law = found.law
    leads = (law["slot"], tuple(law["state"])) if law else None
    names = found.causes if found.verdict == "identified" else []
    return {
        "case": case.case,
        "truth": case.truth,
        "seed": case.seed,
        "verdict": found.verdict,
        "causes": " + ".join(found.causes),
        "slot": law["slot"] if law else "",
        "state": " x ".join(law["state"]) if law else "",
        "right_law": int(bool(case.effects) and leads == known[case.truth].law),
        "right_name": int(bool(names) and tuple(names) == case.effects),
        "wrong_name": int(bool(names) and (tuple(names) != case.effects or case.case == "removed")),
        "p": round(found.p, 4),
    }


def diagnose(kept=KEPT):
    """Diagnose every planned case that `kept` lacks; a row is written as it is found."""
    rig, known = study()
    strong, done, last = strengths(), set(), (None, None)
    rows = kept_rates.kept(kept)
    if not rows.empty:
        done = set(rows[KEY].itertuples(index=False, name=None))
    if kept.exists() and len(rows) < len(pd.read_csv(kept)):
        kept.unlink()  # the others are of another engine or of other rules
        for row in rows.to_dict("records"):
            append(kept, row)
    for case in planned():
        if (case.case, case.truth, case.seed) in done:
            continue
        start, drawn = time.process_time(), (case.truth, case.point, case.seed)
        if last[0] != drawn:
            effects = {n: strong[n] for n in case.effects}
            last = drawn, hidden.draw(case.point, rig, known, effects, case.seed)[0]
        without = case.effects if case.case == "removed" else ()
        catalogue = {n: m for n, m in known.items() if n not in without}
        row = judged(case, contacts.discovered(last[1], rig, catalogue), known)
        row["seconds"] = round(time.process_time() - start, 1)
        row |= {"date": date.today().isoformat(), **kept_rates.present()}
        append(kept, row)
        print(row, flush=True)


def table(rows):
    """Markdown of the rates of fresh rows; a sentence where there is none."""
    lines = [kept_rates.dated(rows, len(planned()), COMMAND)]
    if rows.empty:
        return lines[0]
    lines += ["| | share (95 % interval) |", "|---|---|"]
    null, full, out = (rows[rows["case"] == k] for k in KINDS)

    def add(words, hits):
        lines.append(f"| {words} | {share(hits)} |")

    add("no effect: adequate", null["verdict"] == "adequate")
    add("no effect: no law claimed", ~null["verdict"].isin(["identified", "discovered"]))
    add("a mechanism: slot and state of the law that leads are its own", full["right_law"])
    add("a mechanism: identified and right", full["right_name"])
    add("a mechanism: identified and wrong", full["wrong_name"])
    add("taken out of the catalogue: slot and state are its own", out["right_law"])
    add("taken out of the catalogue: identified", out["verdict"] == "identified")
    lines += ["", "| | " + " | ".join(VERDICTS) + " |", "|---|" + "---|" * len(VERDICTS)]
    for words, group in zip(
        ("no effect", "a mechanism", "taken out of the catalogue"), (null, full, out), strict=True
    ):
        count = [str(int((group["verdict"] == v).sum())) for v in VERDICTS]
        lines.append(f"| {words} | " + " | ".join(count) + " |")
    lines += ["", *_by_mechanism(full)]
    return "\n".join(lines) + "\n"


def _by_mechanism(full):
    yield "| hidden | identified and right | slot and state are its own | verdicts |"
    yield "|---|---|---|---|"
    for name, own in full.groupby("truth"):
        told = ", ".join(f"{n} {v}" for v, n in own["verdict"].value_counts().items())
        yield (
            f"| {name.replace('_', ' ')} | {own['right_name'].sum()} of {len(own)} "
            f"| {own['right_law'].sum()} of {len(own)} | {told} |"
        )


def kept_table():
    """`table` of what is kept and fresh."""
    return table(kept_rates.kept(KEPT))


if __name__ == "__main__":
    if sys.argv[1] == "diagnose":
        diagnose()
    else:
        kept_rates.show(PAGE, MARK, kept_table())
