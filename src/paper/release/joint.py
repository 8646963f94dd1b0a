"""The joint studies of `docs/joint-studies.md`, each computed from its kept results;
`joint.md.j2` has the words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from calibration.chain.joint.words import sentences
from calibration.figures import label, response_of
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed
from paper.release.first_screen import counted

STUDY = Path("joint") / "joint.json"
ABOUT = {
    "salt": (
        "Salt",
        "config/config.yaml",
        "The paper's heap, inclined plane, drop and shear ring, each at full scale "
        "(`config/joint.yaml`). The first calibration takes what the paper found in plane, drop "
        "and ring as exact, assumes Poisson's ratio, and calibrates three factors to the heap.",
    ),
    "maize": (
        "Maize",
        "examples/maize/config.yaml",
        "Heap and bulk density are of two lots of dent corn. The friction on steel, of another "
        "paper, is a prior. Nobody has measured the hopper: it is a test that could be made next.",
    ),
}
"""{kept study: (title, configuration of its calibration to one target, what its values are
of)}."""


def values(kept: str | Path) -> dict[str, Any]:
    """{name: value} of `joint.md.j2`, from the folder of kept results."""
    kept = Path(kept)
    return {"studies": [study(kept, name) for name in ABOUT if (kept / name / STUDY).is_file()]}


def study(folder: Path, name: str) -> dict[str, Any]:
    """What one kept study says: what the calibration to one target gives in every test, and what
    that to all targets gives. folder: of all kept results."""
    kept = folder / name
    title, configuration, about = ABOUT[name]
    fixed_at = yaml.safe_load(Path(configuration).read_text("utf-8")).get("fixed", {})
    found, single = read_json(kept / STUDY), _machines(kept, "push_through")
    both, parameters = _machines(kept, "joint_push_through"), found["parameters"]
    alone = _single(kept)
    return {
        "title": title,
        "about": about,
        "runs": ", ".join(f"{n} of {label(rig)}" for rig, n in found["runs"].items()),
        "pushed": bool(both),
        "tests": [_test(target, single, both) for target in found["targets"]],
        "parameters": _parameters(parameters, alone, found["box"], fixed_at),
        "outside": _outside(parameters, alone, fixed_at),
        "wider": _wider(parameters, alone),
        "said": sentences(found, response_of(found["targets"][0]["metric"])),
    }


def _machines(kept, stage):
    """Rows of what the draws of a posterior gave in the machines; none where none was run."""
    path = kept / stage / f"{stage}.json"
    return read_json(path)["metrics"] if path.is_file() else []


def _test(target, single, both):
    """A target beside what each calibration gives in its test."""
    metric, measured = response_of(target["metric"]), target["measured"]
    return {
        "name": f"{label(target['rig'])}, {metric.name}",
        "measured": metric.value(measured),
        "single": _told(_machine(target, single), measured, metric),
        "joint": _told(_machine(target, both), measured, metric)
        or f"{metric.value(target['predicted'])}, {_missed(target['predicted'], measured)}",
        "pull": fixed(target["pull"], 1, "+").replace("-", "−"),
        "others": fixed(target["pull_others"], 1, "+").replace("-", "−"),
    }


def _machine(target, machines):
    """The machine that is the target's rig: by its name, else the only one with its metric."""
    same = [m for m in machines if m["metric"] == target["metric"]]
    return next((m for m in same if m["machine"] == target["rig"]), same[0] if same else None)


def _told(row, measured, metric):
    """Mean with the interval of a further run, by how much the mean misses, and whether the
    measured value lies in the interval; empty without runs."""
    if row is None:
        return ""
    if row["low"] is None:
        return "no value"
    ends = f"{metric.value(row['low'])} to {metric.value(row['high'])}"
    where = "inside" if row["low"] <= measured <= row["high"] else "outside"
    return f"{metric.value(row['mean'])} ({ends}), {_missed(row['mean'], measured)}, {where}"


def _missed(value, measured):
    return f"{fixed(100.0 * (value / measured - 1.0), 1, '+').replace('-', '−')} %"


def _single(kept):
    """{parameter: its interval} of the posterior of one target."""
    path = kept / "posterior" / "parameters.csv"
    if not path.is_file():
        return {}
    return {r["parameter"]: (r["low"], r["high"]) for r in read_written(path).to_dict("records")}


def _wider(joint, single):
    """Of the parameters that both calibrations give: how many intervals by all targets are wider
    than those by one, and how many narrower."""
    widths = [(np.ptp(joint[n]["interval"]), np.ptp(ends)) for n, ends in single.items()]
    return {
        "wider": counted(sum(every > one for every, one in widths)),
        "narrower": counted(sum(every <= one for every, one in widths)),
    }


def _outside(joint, single, fixed_at):
    """ "name (value)" of those that one target's calibration holds outside the interval by all."""
    held = {n: fixed_at[n] for n in joint if n in fixed_at and n not in single}
    ends = {n: joint[n]["interval"] for n in held}
    return [f"{label(n)} ({v:g})" for n, v in held.items() if not ends[n][0] <= v <= ends[n][1]]


def _parameters(joint, single, box, fixed_at):
    """A row a parameter: levels, interval by one target or where it is held, interval by all, and
    how wide the second is in the first."""
    rows = []
    for name, p in joint.items():
        low, high = p["interval"]
        own = single.get(name)
        rows.append(
            {
                "name": label(name),
                "levels": _ends(box[name]),
                "single": _ends(own) if own else _held(fixed_at, name),
                "joint": _ends((low, high)),
                "ratio": f"{(high - low) / (own[1] - own[0]):.1f}" if own else "",
                "left": f"{100.0 * p['left']:.0f} %",
            }
        )
    return rows


def _held(fixed_at, name):
    return f"held at {fixed_at[name]:g}" if name in fixed_at else "held"


def _ends(ends):
    return f"{ends[0]:.3g} to {ends[1]:.3g}"
