"""A campaign that is killed at random moments and started again until it is finished:
`python tests/workflow/kills.py FOLDER KILLS SEED [TARGET ...]`, where FOLDER/whole may hold the
undisturbed one.

The moments and the victims are drawn from a seeded generator. What then happens depends on the
machine's speed too, so that a seed repeats the kills and not the outcome.
"""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
from filelock import FileLock, Timeout

ROOT = Path(__file__).parents[2]
READ = ("Snakefile", "workflow", "config", "profiles", "src", "data")
"""What the workflow reads of a checkout."""

MOMENTS = 2.0, 40.0
"""Seconds between two kills: from before snakemake has planned anything to some runs later."""

VICTIMS = ("snakemake", "job", "job", "all")
"""snakemake alone, so that its jobs are orphans; one process of one job; all at once, as when the
machine stops."""

LAST_ORPHAN = 120.0
"""Seconds in which what was orphaned has ended after the campaign."""


def checkout(folder):
    """A folder with links to everything that the workflow reads, and no results."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in READ:
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    return folder


def start(folder, targets=()):
    """The test profile's campaign as a process that leads a group of its own; it is told neither to
    unlock nor to forget anything."""
    command = [sys.executable, "-m", "snakemake", "-j2", "--profile", "profiles/test"]
    with open(folder / "campaign.log", "a") as log:
        return subprocess.Popen(
            [*command, *targets], cwd=folder, stdout=log, stderr=log, start_new_session=True
        )


def finish(folder, targets=()):
    """The campaign without a kill. Raises CalledProcessError where it does not end well."""
    process = start(folder, targets)
    if process.wait():
        raise subprocess.CalledProcessError(process.returncode, "snakemake")


def kill(process, rng):
    """kill -9 of a victim drawn; returns (what it was, whether the campaign itself was met)."""
    victim = rng.choice(VICTIMS)
    draw = rng.random()
    jobs = processes_of_jobs(process)
    if victim == "job" and jobs:
        name = _kill_one(jobs[int(draw * len(jobs))])
        return name, False
    if victim == "all":
        os.killpg(process.pid, signal.SIGKILL)
    else:
        victim = "snakemake"
        process.kill()
    process.wait()
    return victim, True


def processes_of_jobs(process):
    """Living processes below the campaign that are a snakemake of their own: those that a job
    cannot do without.

    Campaign and job also ask other programs, such as git, what machine this is, and go on without
    their answer: such a child still has its parent's command line until it has become the other
    program. And a process that has ended can still be in the list."""
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        with contextlib.suppress(psutil.Error):
            command = child.cmdline()
            ended = child.status() == psutil.STATUS_ZOMBIE
            a_copy = command == child.parent().cmdline()
            if "snakemake" in " ".join(command) and not ended and not a_copy:
                found.append(child)
    return found


def _kill_one(job):
    try:
        job.kill()
    except psutil.NoSuchProcess:
        return "a job that had just ended"
    return "a job"


def disturbed(folder, kills, seed, targets=(), note=print):
    """Kill the campaign `kills` times, then let it end. Returns the groups of processes that it was
    made in. Raises CalledProcessError where it ends badly after the last kill."""
    rng, made, groups = random.Random(seed), 0, []
    while made < kills:
        process = start(folder, targets)
        groups.append(process.pid)
        over, before = False, made
        while not over and made < kills:
            moment = rng.uniform(*MOMENTS)
            try:
                process.wait(moment)
                over = True  # finished, or stopped as one of its jobs was killed
            except subprocess.TimeoutExpired:
                victim, over = kill(process, rng)
                made += 1
                note(f"kill {made} after {moment:.1f} s: {victim}; {done(folder)} runs made")
        if process.poll() == 0:
            note(f"finished after {made} kills")
            return groups
        if made == before:
            raise subprocess.CalledProcessError(process.returncode, "snakemake")
        if not over:
            process.wait()  # the last kill met a job
    process = start(folder, targets)
    groups.append(process.pid)
    if process.wait():
        raise subprocess.CalledProcessError(process.returncode, "snakemake")
    return groups


def done(folder):
    """Number of runs with a result."""
    return sum(1 for _ in folder.glob("results/runs/*/result.json"))


def orphans(groups):
    """Processes of these groups that still run."""
    found = []
    for process in psutil.process_iter():
        try:
            if os.getpgid(process.pid) in groups and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
        except (psutil.Error, OSError):
            continue
    return found


def wait_for_orphans(groups, seconds=LAST_ORPHAN):
    """Orphans that have not ended within some seconds."""
    end = time.monotonic() + seconds
    while (left := orphans(groups)) and time.monotonic() < end:
        time.sleep(0.5)
    return left


def outcome(folder):
    """{what: content} of a campaign's results: of each run its numbers and the checksums of its
    files, of the study every table and summary. Times that a run took are no outcome."""
    found = {}
    for path in folder.glob("results/runs/*/result.json"):
        result = json.loads(path.read_text())
        found[path.parent.name] = result["metrics"], result["manifest"]["files"], result["spec"]
    for path in folder.glob("results/*/**/*.*"):
        shown = path.relative_to(folder / "results").as_posix()
        if path.suffix in (".csv", ".json") and not shown.startswith("runs/"):
            found[shown] = path.read_text()
    return found


def left_behind(folder):
    """Files in the folders of runs that only a writer at work may have.

    A process that is killed between its result and the removal of its lock's file leaves that file,
    which is empty and locks nothing: nobody enters a finished run again."""
    names = (".*.partial", ".partial.*", "checkpoint.npz")
    found = [p for name in names for p in folder.glob(f"results/runs/*/{name}")]
    locks = folder.glob("results/runs/*/.lock")
    return found + [p for p in locks if not (p.with_name("result.json").exists() and _free(p))]


def _free(path):
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return False
    lock.release()
    return True


def main(folder, kills, seed, targets):
    """Kill a campaign in `folder`/killed, and compare it with the one in `folder`/whole."""
    whole, killed = checkout(folder / "whole"), checkout(folder / "killed")
    if not outcome(whole):
        finish(whole, targets)
    groups = disturbed(killed, kills, seed, targets, note=lambda text: print(text, flush=True))
    print("orphans left:", wait_for_orphans(groups))
    print("left behind:", *left_behind(killed))
    a, b = outcome(whole), outcome(killed)
    print(f"{len(a)} outcomes, different: {sorted(k for k in a | b if a.get(k) != b.get(k))}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
