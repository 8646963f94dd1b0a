"""How far a campaign is, by what its stages declare of their runs."""

import os
from contextlib import suppress
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
    a heap that did not form; short: runs of seconds, which share processes;
    above: of a stage of another layer, as the diagnosis; each_s: wall time [s] of one that is left,
    where runs of its experiment have ended; touched: when one of those left was last written [s],
    0.0 where none has begun."""

    name: str
    done: int
    total: int
    failed: tuple = ()
    planned: bool = True
    valueless: int = 0
    short: bool = False
    above: bool = False
    each_s: float | None = None
    touched: float = 0.0

    @property
    def counted(self) -> bool:
        """Return whether its runs count among the study's."""
        return not (self.short or self.above)

    @property
    def left(self) -> int:
        """Runs that have neither ended nor failed."""
        return self.total - self.done - len(self.failed)

    @property
    def words(self) -> str:
        """'response surface (3 of 17)'."""
        name = self.name.replace("_", " ")
        return f"{name}{', short runs' * self.short} ({self.done} of {self.total})"


@dataclass(frozen=True)
class Progress:
    """Plans of a study, those that every study makes, and mean wall time [s] of their finished
    runs, None before the first; expected_s: what a run takes by its spec, None where nobody knows.
    Both count where a plan does not say what each of its runs takes."""

    plans: tuple
    mean_s: float | None
    expected_s: float | None

    @property
    def chain(self) -> list[Plan]:
        """The plans that every study makes."""
        return [p for p in self.plans if p.counted]

    @property
    def failed(self) -> list[str]:
        """Names of all runs that failed."""
        return [name for plan in self.plans for name in plan.failed]

    @property
    def under_way(self) -> Plan | None:
        """The plan whose runs are being made. Several can be planned, and one whose stage was
        stopped has runs too: the one that was written last, else one that has runs."""
        waiting = [p for p in self.plans if p.planned and p.left]
        return max(waiting, key=lambda p: (p.touched, p.done > 0)) if waiting else None

    def left_s(self, cores: int) -> float | None:
        """Seconds until the chain's runs are made, or those of the stage above that is under way,
        or None: a stage waits for the one before it, so the last run of each may leave cores
        idle."""
        now, other = self.under_way, self.mean_s or self.expected_s
        seconds = 0.0
        for plan in (p for p in ([now] if now and now.above else self.chain) if p.left):
            each = plan.each_s or other
            if not each:
                return None
            seconds += ceil(plan.left / cores) * each
        return seconds or None

    def sentence(self, cores: int) -> str:
        """'12 of 63 runs done, none failed; now screening (12 of 12); about 9 min left on 2
        cores'."""
        done, total = (sum(getattr(p, key) for p in self.chain) for key in ("done", "total"))
        failed = f"{len(self.failed)} failed" if self.failed else "none failed"
        valueless = sum(plan.valueless for plan in self.chain)
        without = f"{valueless} of them without a value, " if valueless else ""
        parts = [f"{done} of {total} runs done, {without}{failed}"]
        now = self.under_way
        if now:
            parts.append(f"now {now.words}")
        left = self.left_s(cores)
        if left:
            above = now if now and now.above else None
            of_it = " of that" if above else ""
            known = self.mean_s or (above and above.done)
            guess = "" if known else ", estimated before the first run"
            unit = "core" if cores == 1 else "cores"
            parts.append(f"about {duration(left)}{of_it} left on {cores} {unit}{guess}")
        return "; ".join(parts)


def progress(config: Config, store: RunStore | None = None) -> Progress:
    """`Progress` of a study, as the store's index has it: no result is read."""
    store = store or RunStore(config.runs)
    walls: dict[str, list[float]] = {}  # {experiment: of the chain}
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
            short=bool(declared and declared.batches),  # a share of a process each
            above=declared is None,
            each_s=_mean([entry["wall_time_s"] for entry in took]),
            touched=_touched(store, set(names) - over - set(failed)),
        )
        found.append((plan, expected or [_experiment(n) for n in names if n not in over]))
        for entry in took if plan.counted else ():
            walls.setdefault(_experiment(entry["run"]), []).append(entry["wall_time_s"])
    asked = {experiment for _, left in found for experiment in left}
    lasted = _expected(config, asked - walls.keys()) | {e: _mean(them) for e, them in walls.items()}
    plans = [
        replace(plan, each_s=plan.each_s or _mean([lasted[e] for e in left if e in lasted]))
        for plan, left in found
    ]
    mean = _mean([wall for them in walls.values() for wall in them])
    return Progress(tuple(plans), mean, None if walls else lasted.get(config.experiment))


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


def _touched(store, names):
    """When one of these runs was last written [s], 0.0 where none has a folder."""
    newest = 0.0
    for name in names:
        with suppress(OSError):  # not begun, or removed meanwhile
            newest = max(newest, store.folder(name).stat().st_mtime)
    return newest


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
