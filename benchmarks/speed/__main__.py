"""Speed of the engine on the work that it is for, beside other engines on the same work.

The page of the results shows the last figures of each case in HISTORY.
"""

import argparse
import math
import os
import platform
import re
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

RESTING = Numerics.model_fields["rest_energy_ratio"].default
"""Energy of motion below which grains are at rest, as `motion` has it."""
HISTORY = Path("results/reference/speed/history.csv")
ROUNDS = 7


def main() -> None:
    """Run the cases that are asked for, print their figures and append them to HISTORY if told."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description=__doc__)
    parser.add_argument("case", choices=CASES, nargs="+")
    parser.add_argument("--record", action="store_true", help=f"append the figures to {HISTORY}")
    args = parser.parse_args()
    compile_engine()
    rows = [row for case in args.case for row in CASES[case]()]
    if args.record:
        write_table(with_rows(HISTORY, [made_by() | row for row in rows]), HISTORY)
    print(pd.DataFrame(rows).to_string(index=False))


def _million():
    """A million grains come to rest on two threads: a hundred settled beds side by side, whose
    walls are taken out."""
    start = cases.tiled(cases.bed(10_000), 10)
    sim = cases.bed(1_000_000, start=start, stir=0.0, threads=2)
    begin, energy = time.perf_counter(), math.inf
    while energy >= RESTING:
        if sim.steps >= cases.SETTLE_STEPS:
            raise DemError(f"a million grains: not at rest after {sim.steps} steps: {energy:.3g}")
        sim.advance(300)
        energy = motion(sim)
    spent = time.perf_counter() - begin
    own = {"wall_time_s": spent, "particle_steps_per_s": sim.n * sim.steps / spent}
    return [cases.figures_of("bed of 1000000 on two threads", sim) | own]


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
    return [{"case": "one run on two threads", "wall_time_s": both, "ratio": alone / both}]


def _wall_time(sim):
    begin = time.perf_counter()
    sim.advance(cases.BLOCK)
    return time.perf_counter() - begin


def _peers():
    """This engine and the others on one settled bed, in one call, with ratios of processor time and
    their 95 % intervals over ten blocks."""
    with tempfile.TemporaryDirectory() as folder:
        sim, ours = _ten_blocks("constant_torque")
        others = run_peers(sim, cases.box_width(sim.n), Path(folder))
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


CASES = {
    "bed": cases.timed_bed,
    "heap": cases.timed_heap,
    "million": _million,
    "threads": _threads,
    "peers": _peers,
}


def made_by() -> dict[str, Any]:
    """Date, engine, machine and its load: processes that run or wait to, the mean of the last
    minute."""
    model = re.search(r"model name\s*: (.+)", Path("/proc/cpuinfo").read_text())
    return {
        "date": time.strftime("%Y-%m-%d"),
        "engine": engine_fingerprint(),
        "machine": model[1].strip() if model else platform.machine(),
        "load": round(os.getloadavg()[0], 2),
    }


def with_rows(path: Path, rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Return the rows of a CSV file, which need not be there, and further ones; each cell a
    text."""
    old = read_written(path, dtype=str) if path.exists() else pd.DataFrame()
    lines = [{key: str(value) for key, value in row.items()} for row in rows]
    return pd.concat([old, pd.DataFrame(lines)])


if __name__ == "__main__":
    main()
