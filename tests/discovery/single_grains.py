"""The benchmark's cases on single grains, diagnosed as drops and slides are: by free laws and the
integrated contact, in place of emulators.

    python tests/discovery/single_grains.py diagnose   goes on where it was cut off
    python tests/discovery/single_grains.py table      writes the table into the documentation

Data are drawn by the engine as the benchmark draws them, at the strengths that its kept cases have.
A case that has been diagnosed stands in KEPT; delete its row, or the file, to have it diagnosed
anew.
"""

import sys
import time
from datetime import date
from pathlib import Path

import pandas as pd
import yaml

from dem.fingerprint import engine_fingerprint
from diagnosis import contacts
from diagnosis.benchmark import hidden
from diagnosis.benchmark.kept import append, between, share
from diagnosis.benchmark.study import cases
from diagnosis.catalogue import load_catalogue
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of, read_settings

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "results/reference/discovery"
KEPT, OLDER = FOLDER / "single_grains.csv", FOLDER / "cases.csv"
PAGE = ROOT / "docs/diagnosis-benchmark.md"
BEGIN, END = "<!-- single grains -->\n", "<!-- end of single grains -->"
POINTS = 4
"""Of the benchmark's eight: what a core does in a quarter of an hour."""

KINDS = ("no effect", "mechanism", "removed")
VERDICTS = ("adequate", "identified", "discovered", "ambiguous", "unexplained")
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
    """{mechanism: strength} of the kept cases of the benchmark."""
    kept = pd.read_csv(OLDER, keep_default_na=False)
    kept = kept[(kept["case"] == "mechanism") & (kept["strength"] == 1.0)]
    return {r["truth"]: float(r["hidden"].split()[0]) for _, r in kept.iterrows()}


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
    if kept.exists():
        rows = pd.read_csv(kept, keep_default_na=False)
        done = set(rows[KEY].itertuples(index=False, name=None))
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
        row |= {"date": date.today().isoformat(), "engine": engine_fingerprint()}
        append(kept, row)
        print(row, flush=True)


def table(rows, older):
    """Markdown of the rates, the same cases by emulators beside them."""
    older = older[older["bench"] == "grains"].merge(rows[KEY], on=KEY)
    older = older[older["strength"].isin([0.0, 1.0])]
    engines = " and ".join(f"`{e}`" for e in dict.fromkeys(rows["engine"]))
    dates = " and ".join(dict.fromkeys(rows["date"]))
    lines = [
        f"{len(rows)} of the {len(planned())} planned cases have been diagnosed, on {dates},",
        f"engine {engines}.",
        "",
        "| | by free laws | by emulators |",
        "|---|---|---|",
    ]
    null, full, out = ([t[t["case"] == k] for t in (rows, older)] for k in KINDS)

    def add(words, *hits):
        lines.append(f"| {words} | " + " | ".join(share(h) if h is not None else "" for h in hits)
                     + " |")  # fmt: skip

    sure = full[1]["verdict"] == "identified"
    right = full[1]["outcome"] == full[1]["truth"]
    add("no effect: adequate", *(t["verdict"] == "adequate" for t in null))
    add("a mechanism: slot and state of the law that leads are its own", full[0]["right_law"], None)
    add("a mechanism: identified and right", full[0]["right_name"], sure & right)
    add("a mechanism: identified and wrong", full[0]["wrong_name"], sure & ~right)
    add("taken out of the catalogue: slot and state are its own", out[0]["right_law"], None)
    add("taken out of the catalogue: identified", *(t["verdict"] == "identified" for t in out))
    lines += ["", "| by free laws | " + " | ".join(VERDICTS) + " |", "|---|" + "---|" * 5]
    for words, (group, _) in zip(
        ("no effect", "a mechanism", "taken out of the catalogue"), (null, full, out), strict=True
    ):
        count = [str(int((group["verdict"] == v).sum())) for v in VERDICTS]
        lines.append(f"| {words} | " + " | ".join(count) + " |")
    lines += [
        "",
        "| hidden | identified and right | slot and state of the law that leads are its own | "
        "verdicts |",
        "|---|---|---|---|",
    ]
    for name, own in full[0].groupby("truth"):
        said = own["verdict"].value_counts()
        told = ", ".join(f"{n} {v}" for v, n in said.items())
        lines.append(
            f"| {name.replace('_', ' ')} | {own['right_name'].sum()} of {len(own)} "
            f"| {own['right_law'].sum()} of {len(own)} | {told} |"
        )
    return "\n".join(lines) + "\n"


def kept_table():
    """`table` of what is kept."""
    return table(*(pd.read_csv(f, keep_default_na=False) for f in (KEPT, OLDER)))


def shown(page):
    """The part of the documentation that the table stands in."""
    return between(page, BEGIN, END)


def write_table():
    """Put the table of the kept rows into the documentation."""
    text = PAGE.read_text()
    PAGE.write_text(text.replace(BEGIN + shown(text) + END, BEGIN + kept_table() + END))


if __name__ == "__main__":
    {"diagnose": diagnose, "table": write_table}[sys.argv[1]]()
