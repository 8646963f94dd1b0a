"""All planned data sets of strangers, diagnosed with the whole catalogue, and the table of rates.

    python tests/discovery/foreign/rates.py diagnose       goes on where it was cut off
    python tests/discovery/foreign/rates.py diagnose 0 2   every second set, for two at once
    python tests/discovery/foreign/rates.py table          writes the table into the documentation

A set that has been diagnosed stands in KEPT and is not drawn again; delete its row, or the file, to
have it diagnosed anew.
"""

import sys
import tempfile
import time
from collections import Counter
from dataclasses import astuple, dataclass
from datetime import date
from functools import cache
from pathlib import Path

import closed_forms
import numpy as np
import pandas as pd
import yaml

from dem.fingerprint import engine_fingerprint
from diagnosis import contacts
from diagnosis.benchmark.kept import append, between, share
from diagnosis.catalogue import load_catalogue
from diagnosis.measurements import read_measurements
from diagnosis.rig import Rig
from diagnosis.settings import read_settings

ROOT = Path(__file__).parents[3]
KEPT = ROOT / "results/reference/discovery/foreign.csv"
PAGE = ROOT / "docs/diagnosis-benchmark.md"
BEGIN, END = "<!-- foreign -->\n", "<!-- end of foreign -->"
DRAWS = {5.0: 1, 10.0: 2, 20.0: 1}
"""Standard errors that a law is large -> data sets of each law."""

NULL_DRAWS = 23  # of each kind: the share of all that are adequate is then known to 3 %
FIRST_SEED = 3000
"""Draws from 3000 on were never looked at while the method was made."""

LAWS = {law.name: law for law in closed_forms.LAWS}
VERDICTS = ("adequate", "identified", "discovered", "ambiguous", "unexplained")


@dataclass(frozen=True)
class Planned:
    """One data set to be drawn; size 0 is a null."""

    name: str
    size: float
    seed: int
    which: int

    def draw(self):
        """The `closed_forms.Set`."""
        if self.size:
            return closed_forms.draw(LAWS[self.name], self.size, self.seed, self.which)
        return closed_forms.null(self.name, self.seed, self.which)


def planned():
    """Every set, decided beforehand: all laws at three sizes, all nulls."""
    laws = [
        Planned(name, size, FIRST_SEED + k, k)
        for size, draws in DRAWS.items()
        for name in LAWS
        for k in range(draws)
    ]
    nulls = [
        Planned(n, 0.0, FIRST_SEED + k, k) for n in closed_forms.NULLS for k in range(NULL_DRAWS)
    ]
    # those that criteria are asked of come first, should the time not suffice for all
    return sorted(laws + nulls, key=lambda s: (s.size not in (0.0, 10.0), s.which))


def right(found, law):
    """Whether slot and state are those of the stranger's law."""
    return found.law is not None and (found.law["slot"], tuple(found.law["state"])) in law.right


def inside(found, drawn):
    """Whether the true curve lies in the band over the whole supported range; None where there is
    no such curve to compare: what an attraction adds is no coefficient."""
    law = drawn.law
    if law is None or law.curve is None or law.right[0][0] not in ("restitution", "friction"):
        return None
    if not found.law or (found.law["slot"], tuple(found.law["state"])) != law.right[0]:
        return None
    return all(_holds(v, drawn, law.right[0][1]) for v in found.law["values"])


def _holds(place, drawn, state):
    x = {k: np.array([np.nanmedian(c)]) for k, c in drawn.levers.items() if not np.isnan(c).all()}
    if state == ("speed",):
        x["drop_height_mm"] = np.array([place["state"] ** 2 / (2e-3 * closed_forms.G)])
    elif state == ("size",):
        x["particle_diameter_mm"] = np.array([place["state"]])
    elif state == ("rate",):
        x["tilt_rate_deg_s"] = np.array([place["state"]])
    else:
        x["particle_diameter_mm"] = place["state"] / closed_forms.speed(x["drop_height_mm"])
    true = float(drawn.law.curve(x, drawn.strength)[0])
    return place["low"] <= true <= place["high"]


def judged(item, found, drawn, seconds):
    """A row of KEPT."""
    law, causes = drawn.law, found.causes
    named = causes[0] if found.verdict == "identified" else ""
    band = inside(found, drawn)
    return {
        **dict(zip(("name", "size", "seed", "which"), astuple(item), strict=True)),
        "verdict": found.verdict,
        "named": named,
        "slot": found.law["slot"] if found.law else "",
        "state": " x ".join(found.law["state"]) if found.law else "",
        "right": int(law is not None and right(found, law)),
        "band": "" if band is None else int(band),
        "wrong_name": int(bool(named) and not (law and named in law.names)),
        "p": round(found.p, 4),
        "seconds": round(seconds, 1),
        "date": date.today().isoformat(),
        "engine": engine_fingerprint(),
    }


@cache
def study():
    """Rig and catalogue of the shipped study."""
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())["run"]
    return Rig(read_settings(ROOT / "config/diagnosis.yaml"), base), load_catalogue()


def diagnosed(item):
    """The row of a planned set, read from a file as a user's table is."""
    drawn, start = item.draw(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "measurements.csv"
        drawn.table.to_csv(path, index=False)
        measurements = read_measurements(path)
    found = contacts.discovered(measurements, *study())
    return judged(item, found, drawn, time.process_time() - start)


def diagnose(part=0, parts=1, kept=KEPT):
    """Diagnose every `parts`-th planned set that `kept` lacks; a row is written as it is found."""
    done = set()
    if kept.exists():
        rows = pd.read_csv(kept, keep_default_na=False)
        done = {(r["name"], float(r["size"]), int(r["seed"])) for _, r in rows.iterrows()}
    for item in planned()[part::parts]:
        if (item.name, item.size, item.seed) in done:
            continue
        row = diagnosed(item)
        append(kept, row)
        print(row, flush=True)


def _share(hits, asked):
    return f"{share(hits)} | {asked} |"


def table(rows):
    """Markdown of the rates, and of the verdicts."""
    laws, nulls = rows[rows["size"] > 0], rows[rows["size"] == 0]
    engines = " and ".join(f"`{e}`" for e in dict.fromkeys(rows["engine"]))
    lines = [
        f"{len(rows)} of the {len(planned())} planned sets have been diagnosed, on",
        f"{' and '.join(dict.fromkeys(rows['date']))}, engine {engines}.",
        "",
    ]
    lines += ["| | share (95 % interval) | asked |", "|---|---|---|"]
    for size, own in laws.groupby("size"):
        asked = "80 %" if size == 10.0 else ""
        lines.append(f"| {size:g} standard errors: right slot and state | "
                     + _share(own["right"], asked))  # fmt: skip
    bands = laws[laws["band"].astype(str) != ""]["band"].astype(float)
    lines.append("| the true curve in its band | " + _share(bands, "90 %"))
    lines.append(
        "| a law: wrong name of the catalogue | " + _share(laws["wrong_name"], "at most 5 %")
    )
    fine, shared = nulls["verdict"] == "adequate", nulls["name"].isin(closed_forms.SHARED)
    lines.append("| no law: adequate | " + _share(fine, "95 %"))
    lines.append("| no law, readings share no error: adequate | " + _share(fine[~shared], "95 %"))
    lines.append("| no law, readings share an error: adequate | " + _share(fine[shared], "95 %"))
    lines += ["", "| verdict | " + " | ".join(VERDICTS) + " |", "|---|" + "---|" * len(VERDICTS)]
    groups = [(f"{s:g} standard errors", g) for s, g in laws.groupby("size")]
    groups += [(f"no law: {name}", g) for name, g in nulls.groupby("name", sort=False)]
    for label, group in groups:
        count = Counter(group["verdict"])
        lines.append(f"| {label} | " + " | ".join(str(count[v]) for v in VERDICTS) + " |")
    lines += ["", "| no law | adequate (95 % interval) |", "|---|---|"]
    for name, group in nulls.groupby("name", sort=False):
        lines.append(f"| {name} | {share(group['verdict'] == 'adequate')} |")
    missed = laws[(laws["right"] == 0) & (laws["size"] >= 10.0)]
    if len(missed):
        lines += ["", "Not right at ten or twenty standard errors:", ""]
        lines += [
            f"- {r['name']} ({r['size']:g}): {r['verdict']}"
            + (f", {r['slot']} of {r['state'] or 'none'}" if r["slot"] else "")
            for _, r in missed.iterrows()
        ]
    return "\n".join(lines) + "\n"


def shown(page):
    """The part of the documentation that the table stands in."""
    return between(page, BEGIN, END)


def write_table(kept=KEPT, page=PAGE):
    """Put the table of the kept rows into the documentation."""
    text = page.read_text()
    new = table(pd.read_csv(kept, keep_default_na=False))
    page.write_text(text.replace(BEGIN + shown(text) + END, BEGIN + new + END))


if __name__ == "__main__":
    what, *parts = sys.argv[1:]
    {"diagnose": diagnose, "table": write_table}[what](*map(int, parts))
