"""What the diagnosis says of each measured set: `python data/literature/findings.py` writes
findings.json and the table of README.md; with names of sets, those alone are made anew.

Balls of known size and weight are diagnosed with the catalogue, by the engine's own contact.
The others, and the shear tests, by the free laws alone: the base model of a shear test is one
coefficient of friction and not the simulated cell.
"""

import json
import sys
from pathlib import Path

import yaml

from benchmarks.rates.simulated import salt_settings
from calibration.study.config import overlay, parse_config
from diagnosis import contacts
from diagnosis.catalogue import load_catalogue
from diagnosis.measurements import read_all
from diagnosis.rig import Rig
from diagnosis.table_model.found import discover

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
KEPT, PAGE = FOLDER / "findings.json", FOLDER / "README.md"
BEGIN, END = "<!-- findings -->\n", "<!-- end of findings -->"
BALLS = {
    # diameter [mm] and density [kg/m3] by the rules of each game
    "table_tennis_ball": (40.0, 80.57),
    "golf_ball_flights": (42.67, 1129.0),
    "tennis_ball_flights": (66.7, 371.0),
}
BY_FREE_LAWS = (
    "rubber_ball_flights",
    "rubber_ball_two_instruments",
    "bouncy_ball",
    "shear_ccgm_coated_beads",
    "shear_ccgm_two_tests",
    "shear_annular_wet_day1",
    "shear_annular_wet_day2",
    "shear_annular_wet_two_days",
    "shear_quartz_sand_peak",
    "shear_quartz_sand_reactivation",
)
ALL = (*BALLS, *BY_FREE_LAWS)


def finding(name):
    """A mapping of what the diagnosis says of one set."""
    of = read_all(FOLDER / f"{name}.csv")
    found = _of_ball(of, *BALLS[name]) if name in BALLS else discover(of.fitted, aside=of.aside)
    return {
        "settings": len(of.fitted),
        "verdict": found.verdict,
        "causes": found.causes,
        "misfit": round(found.misfit["p"], 4),
        "p": round(found.p, 4),
        "laws": [_law(law) for law in found.laws],
        "errors": [e["sentence"] for e in found.errors],
        "rows": [r["line"] for r in found.rows],
    }


def _law(law):
    rivals = [r["words"] for r in law["rivals"]]
    own = {k: law[k] for k in ("experiment", "slot", "state", "names", "forms", "sentence")}
    return own | {"rivals": rivals}


def _of_ball(of, diameter, density):
    """`Found` of a ball's drops, of its own size and weight."""
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    grain = {"run": {"materials": {"particle": {"density_kg_m3": density}}}}
    config = parse_config(overlay(base, grain))
    run = {"run": {"particles": {"diameter_mm": diameter}}}
    settings = salt_settings({"experiments": {"drop": run}})
    return contacts.discovered(of.fitted, Rig(settings, config.run), load_catalogue(), of.aside)


def table(kept):
    """Markdown of the kept findings."""
    lines = ["| set | settings | verdict | p of the misfit | what is found |"]
    lines.append("|---|---|---|---|---|")
    for name in ALL:
        f = kept[name]
        verdict = f["verdict"] + (f": {', '.join(f['causes'])}" if f["causes"] else "")
        parts = []
        for law in f["laws"]:
            parts.append(law["sentence"].rstrip("."))
            parts += [f"forms that fit: {', '.join(law['forms'])}"] if law["forms"] else []
            parts += [f"not told from it: {', '.join(law['rivals'])}"] if law["rivals"] else []
        parts += [e.rstrip(".") for e in f["errors"]]
        parts += [f"set aside: line {', '.join(map(str, f['rows']))}"] if f["rows"] else []
        what = "; ".join(p for p in parts if p).replace("_", " ")
        lines.append(
            f"| {name.replace('_', ' ')} | {f['settings']} | {verdict.replace('_', ' ')} "
            f"| {f['misfit']:.2g} | {what} |"
        )
    return "\n".join(lines) + "\n"


def shown(page):
    """The part of the page that the table stands in."""
    return page.split(BEGIN)[1].split(END)[0]


def main(names):
    """Make the findings of the named sets, or of all, and write them down."""
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    for name in names or ALL:
        kept[name] = finding(name)
        print(name, kept[name], flush=True)
        KEPT.write_text(json.dumps(kept, indent=1) + "\n")
    if set(kept) >= set(ALL):
        text = PAGE.read_text()
        PAGE.write_text(text.replace(BEGIN + shown(text) + END, BEGIN + table(kept) + END))


if __name__ == "__main__":
    main(sys.argv[1:])
