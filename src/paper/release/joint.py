"""The studies by all their tests in docs/results.md, each computed from its kept results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from calibration.figures import label, response_of
from calibration.files import read_json
from calibration.intake.tables import read_written
from calibration.statistics.numbers import fixed

STUDY = Path("joint") / "joint.json"
CONFIGURATIONS = {
    "salt": "config/config.yaml",
    "maize": "examples/maize/config.yaml",
}
"""{kept study: configuration of its calibration to one target}."""


def study(folder: Path, name: str) -> dict[str, Any]:
    """What one kept study says: what the calibration to one target gives in every test, and what
    that to all targets gives. folder: of all kept results."""
    kept = folder / name
    fixed_at = yaml.safe_load(Path(CONFIGURATIONS[name]).read_text("utf-8")).get("fixed", {})
    found, single = read_json(kept / STUDY), _machines(kept, "push_through")
    both, parameters = _machines(kept, "joint_push_through"), found["parameters"]
    alone = _single(kept)
    return {
        "tests": [_test(target, single, both) for target in found["targets"]],
        "parameters": _parameters(parameters, alone, found["box"], fixed_at),
        "outside": _outside(parameters, alone, fixed_at),
        "largest_pull": fixed(max(abs(t["pull_others"]) for t in found["targets"]), 1),
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


def _outside(joint, single, fixed_at):
    """ "name (value)" of those that one target's calibration holds outside the interval by all."""
    held = {n: fixed_at[n] for n in joint if n in fixed_at and n not in single}
    ends = {n: joint[n]["interval"] for n in held}
    return [f"{label(n)} ({v:g})" for n, v in held.items() if not ends[n][0] <= v <= ends[n][1]]


def _parameters(joint, single, box, fixed_at):
    """Return a row for each parameter: levels, interval by one target or where it is held, and
    interval by all."""
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
            }
        )
    return rows


def _held(fixed_at, name):
    return f"held at {fixed_at[name]:g}" if name in fixed_at else "held"


def _ends(ends):
    return f"{ends[0]:.3g} to {ends[1]:.3g}"
