"""Speed of the engine on the work that it is for, beside other engines on the same work."""

import argparse
import math
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from benchmarks.speed import cases
from benchmarks.speed.peers import WITHOUT_ROLLING, run_peers
from calibration.files import write_table
from calibration.intake.tables import read_written
from dem.errors import DemError
from dem.experiments.phases import motion
from dem.fingerprint import engine_fingerprint
from dem.precompile import compile_engine
from dem.spec import Numerics

MILLION = "bed of 1000000 on two threads"
"""Name, in the history of speeds, of a million grains that come to rest."""
RESTING = Numerics.model_fields["rest_energy_ratio"].default
"""Energy of motion below which they are at rest, as `motion` has it."""
HISTORY = Path("results/reference/speed/history.csv")
ROUNDS = 7
COLUMNS = (
    "date", "engine", "machine", "case", "particle_steps_per_s", "ratio", "ratio_low", "ratio_high",
    "wall_time_s", "rebuild_share", "peak_memory_MiB", "commit", "dirty_files", "load",
)  # fmt: skip


def main(words: list[str] | None = None) -> int:
    """Run the cases that are asked for and print their figures; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description=__doc__)
    parser.add_argument("--case", choices=CASES, action="append", help="bed and heap unless given")
    parser.add_argument(
        "--peers", action="store_true", help="LIGGGHTS, LAMMPS and YADE on the same settled bed"
    )
    parser.add_argument("--record", action="store_true", help=f"append the figures to {HISTORY}")
    args = parser.parse_args(words)
    compile_engine()
    rows = []
    try:
        for case in args.case or ("bed", "heap"):
            rows.append(CASES[case]())
        if args.peers:
            rows += peer_rows()
    except DemError as fault:
        print(fault, file=sys.stderr)
        return 1
    if args.record:
        append(HISTORY, rows)
    show(rows)
    return 0


def _million():
    """A million grains come to rest on two threads: a hundred settled beds side by side, whose
    walls are taken out."""
    start = cases.tiled(cases.bed(10_000), cases.SETTLE_STEPS, 10)
    sim = cases.bed(1_000_000, start=start, stir=0.0, threads=2)
    begin, energy = time.perf_counter(), [math.inf]
    while energy[-1] >= RESTING and sim.steps < cases.SETTLE_STEPS:
        sim.advance(300)
        energy.append(motion(sim))
    spent = time.perf_counter() - begin
    if energy[-1] >= RESTING:
        raise DemError(
            f"a million grains: not at rest after {sim.steps} steps: energy {energy[-1]:.3g}, "
            f"below {RESTING:g} is rest"
        )
    return cases.figures_of(MILLION, sim) | {
        "steps": sim.steps,
        "wall_time_s": spent,
        "particle_steps_per_s": sim.n * sim.steps / spent,
        "contact_pairs_per_particle": len(sim.contacts()[0]) / sim.n,
        "rest_energy_ratio": energy[-1],
        "highest_rest_energy_ratio": max(energy[1:]),
    }


def _threads():
    """One bed on one thread and on two, in turn; the numbers are the same."""
    sim = cases.bed()
    sim.advance(cases.SETTLE_STEPS)
    state = {name: np.array(value) for name, value in sim.state_dict().items()}
    teams = [cases.bed(threads=number) for number in (1, 2)]
    for team in teams:
        team.restore(state)
    rounds = [[_wall_time(team) for team in teams] for _ in range(ROUNDS)]
    alone, both = np.median(rounds, axis=0)
    return {"case": "one run on two threads", "wall_time_s": both, "ratio": alone / both}


def _wall_time(sim):
    begin = time.perf_counter()
    sim.advance(cases.BLOCK)
    return time.perf_counter() - begin


CASES = {
    "bed": cases.timed_bed,
    "heap": cases.timed_heap,
    "million": _million,
    "threads": _threads,
}


def peer_rows() -> list[dict[str, Any]]:
    """This engine and the others on one settled bed, in one call, with ratios of processor time and
    their 95 % intervals over ten blocks. Raises DemError when none is installed."""
    with tempfile.TemporaryDirectory() as folder:
        sim, ours = _ten_blocks("constant_torque")
        others = run_peers(sim, cases.box_width(sim.n), folder)
    if not others:
        raise DemError("none of liggghts, lmp and yade is installed")
    _, alone = _ten_blocks("none")
    rows = [
        {"case": "peers: this engine", "particle_steps_per_s": np.mean(ours)},
        {"case": "peers: this engine without rolling", "particle_steps_per_s": np.mean(alone)},
    ]
    for name, theirs in others.items():
        own = alone if name.endswith(WITHOUT_ROLLING) else ours
        found = stats.ttest_ind(np.log(own), np.log(theirs), equal_var=False)
        low, high = np.exp(found.confidence_interval())
        rows.append(
            {"case": f"peers: {name}", "particle_steps_per_s": np.mean(theirs)}
            | {"ratio": math.sqrt(low * high), "ratio_low": low, "ratio_high": high}
        )
    return rows


def _ten_blocks(rolling):
    """A settled bed, and its particle-steps per second of processor in each of ten blocks."""
    sim = cases.bed(rolling=rolling)
    sim.advance(cases.SETTLE_STEPS)
    return sim, cases.block_rates(sim, 10)


def machine() -> str:
    """Processor of this machine."""
    try:
        text = Path("/proc/cpuinfo").read_text()
        return re.search(r"model name\s*: (.+)", text)[1].strip()  # type: ignore[index]
    except (OSError, TypeError):
        return platform.processor() or platform.machine()


def tree() -> tuple[str, int | str]:
    """(commit, dirty) of the project's files: the commit they are of, and the number of tracked
    files that differ from it; empty where there is no git."""

    def git(*words):
        command = ["git", "-C", str(Path(__file__).parent), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        changed = git("status", "--porcelain", "--untracked-files=no")
        return git("rev-parse", "--short=12", "HEAD"), len(changed.splitlines())
    except (OSError, subprocess.CalledProcessError):
        return "", ""


def append(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Append one line a case to a CSV history: with the commit, the number of files that differ
    from it and the load of the machine, so that a figure of a changed tree or a busy machine is
    seen as one. An older history gets the columns that it lacks, empty."""
    commit, dirty = tree()
    stamp = made_by() | {"commit": commit, "dirty_files": dirty}
    table = with_rows(path, [stamp | row for row in rows])
    write_table(table.reindex(columns=COLUMNS), path)


def made_by() -> dict[str, Any]:
    """Date, engine, machine and its load: processes that run or wait to, the mean of the last
    minute."""
    return {
        "date": time.strftime("%Y-%m-%d"),
        "engine": engine_fingerprint(),
        "machine": machine(),
        "load": round(os.getloadavg()[0], 2),
    }


def with_rows(path: Path, rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Return the rows of a CSV file, which need not be there, and further ones; each cell a
    text."""
    old = read_written(path, dtype=str) if path.exists() else pd.DataFrame()
    lines = [{key: str(value) for key, value in row.items()} for row in rows]
    return pd.concat([old, pd.DataFrame(lines)])


def show(rows: Sequence[dict[str, Any]]) -> None:
    """Print the figures as a table."""
    for row in rows:
        print(row["case"])
        for key, value in row.items():
            if key != "case":
                print(f"    {key:30s} {value:.4g}")


if __name__ == "__main__":
    sys.exit(main())
