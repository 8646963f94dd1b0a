"""How far a campaign is, by what its stages declare of their runs."""

import os
from dataclasses import dataclass, replace
from math import ceil

from calibration.runs.plans import plans_of
from calibration.runs.store import REFUSED, RunStore
from calibration.study.config import Config, point_spec
from calibration.study.cost import duration, run_seconds
from calibration.study.stage import planning
from dem.results import FAILED, is_current

REPEAT = "failed.yaml"
"""What a run that failed leaves beside its log: its spec, to be repeated."""


@dataclass(frozen=True)
class Plan:
    """Runs of one plan: how many are done of how many, and the names of those that failed. planned
    is false where the number is only expected; valueless: of those done, how many have no value, as
    a heap that did not form; apart: not counted among the study's, as runs of seconds, which share
    processes, and those of the diagnosis; each_s: wall time [s] of one that is left, None where
    nobody knows."""

    name: str
    done: int
    total: int
    failed: tuple = ()
    planned: bool = True
    valueless: int = 0
    apart: bool = False
    each_s: float | None = None

    @property
    def left(self) -> int:
        """Runs that have neither ended nor failed."""
        return self.total - self.done - len(self.failed)


@dataclass(frozen=True)
class Progress:
    """Plans of a study; guessed: whether none of its runs has ended, which would tell how long
    another takes."""

    plans: tuple
    guessed: bool = False

    @property
    def failed(self) -> list[str]:
        """Names of all runs that failed."""
        return [name for plan in self.plans for name in plan.failed]

    @property
    def under_way(self) -> Plan | None:
        """The first plan that has some of its runs, else the first that waits for them; one of the
        study's before others."""
        waiting = [p for p in self.plans if p.planned and p.left]
        return max(waiting, key=lambda p: (p.done > 0, not p.apart), default=None)

    def left_s(self, cores: int) -> float | None:
        """Seconds until the study's runs are made, or those of the plan under way that stands
        apart, or None: a stage waits for the one before it, so the last run of each may leave cores
        idle."""
        now = self.under_way
        asked = [now] if now and now.apart else [p for p in self.plans if not p.apart]
        seconds = 0.0
        for plan in (p for p in asked if p.left):
            if plan.each_s is None:
                return None
            seconds += ceil(plan.left / cores) * plan.each_s
        return seconds or None

    def sentence(self, cores: int) -> str:
        """'12 of 63 runs done, none failed; now screening (12 of 12); about 9 min left on 2
        cores'."""
        counted = [p for p in self.plans if not p.apart]
        done, total, valueless = (
            sum(getattr(p, key) for p in counted) for key in ("done", "total", "valueless")
        )
        failed = f"{len(self.failed)} failed" if self.failed else "none failed"
        without = f"{valueless} of them without a value, " if valueless else ""
        parts = [f"{done} of {total} runs done, {without}{failed}"]
        now = self.under_way
        if now:
            parts.append(f"now {now.name.replace('_', ' ')} ({now.done} of {now.total})")
        left = self.left_s(cores)
        if left:
            apart = now if now and now.apart else None
            of_it = " of that" if apart else ""
            known = not self.guessed or (apart and apart.done)
            guess = "" if known else ", estimated before the first run"
            unit = "core" if cores == 1 else "cores"
            parts.append(f"about {duration(left)}{of_it} left on {cores} {unit}{guess}")
        return "; ".join(parts)


def progress(config: Config, store: RunStore | None = None) -> Progress:
    """`Progress` of a study, as the store's index has it: no result is read."""
    store = store or RunStore(config.runs)
    walls: dict[str, list[float]] = {}  # {experiment: of the study's runs}
    found: list[tuple[Plan, list[str]]] = []  # with the experiments of the runs that are left
    for name, declared, names, own in _plans(config):
        expected = [] if names or not own else declared.expected(config)
        if not names and not expected:
            continue
        ended = [e for n in names if (e := store.known(n)) and is_current(e["engine"])]
        over = {entry["run"] for entry in ended}
        if declared is None:  # stages above keep a run without a value, and go on
            over |= {n for n in names if (store.folder(n) / FAILED).exists()}
        failed = tuple(n for n in names if n not in over and (store.folder(n) / REPEAT).exists())
        took = [e for e in ended if e["wall_time_s"] is not None]
        plan = Plan(
            name,
            len(over),
            len(names) or len(expected),
            failed,
            planned=bool(names),
            valueless=sum(bool(entry.get(REFUSED)) for entry in ended),
            apart=declared is None or bool(declared.batches),
            each_s=_mean([entry["wall_time_s"] for entry in took]),
        )
        found.append((plan, expected or [_experiment(n) for n in names if n not in over]))
        for entry in () if plan.apart else took:
            walls.setdefault(_experiment(entry["run"]), []).append(entry["wall_time_s"])
    asked = {experiment for _, left in found for experiment in left}
    lasts = _expected(config, asked - walls.keys()) | {e: _mean(them) for e, them in walls.items()}
    other = _mean([wall for them in walls.values() for wall in them])
    other = other or lasts.get(config.experiment)
    plans = [
        replace(plan, each_s=plan.each_s or _mean([lasts[e] for e in left if e in lasts]) or other)
        for plan, left in found
    ]
    return Progress(tuple(plans), guessed=not walls)


def _experiment(run):
    """Of which a run is, by its name."""
    return run.rpartition("-")[0]


def _mean(seconds):
    return sum(seconds) / len(seconds) if seconds else None


def _plans(config):
    """[(folder of a plan, what is declared of it, its runs, whether the study makes it of its own
    accord)] in the stages' order. Plans of stages above this layer come first, as their folders
    have them, without a declaration."""
    folder, known = f"{config.results}/{config.name}", planning(config)
    made = {name: runs for name, runs in plans_of(folder) if runs}
    others = made.keys() - {plan.folder for plan, _ in known}
    return [
        *((name, None, made[name], False) for name in sorted(others)),
        *((plan.folder, plan, made.get(plan.folder, {}), own) for plan, own in known),
    ]


def _expected(config, experiments):
    """{experiment: seconds of a run by its spec}, of those of the study's where that tells it."""
    runs = {test.experiment: config.run_of(name) for name, test in config.tests.items()}
    runs[config.experiment] = config.own_run
    found = {
        e: run_seconds(point_spec(runs[e], e, {}, config.seed)) for e in experiments & set(runs)
    }
    return {e: seconds for e, seconds in found.items() if seconds}


def cores() -> int:
    """Cores that the workflow was given."""
    return int(os.environ.get("CAMPAIGN_CORES", 1))
