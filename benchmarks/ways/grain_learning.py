"""GrainLearning beside the project's ways: its iterative Bayesian filter, in a Python of its own.

GrainLearning 2.0.5 asks for numpy below 2, this project for numpy above; they cannot share an
environment. So it runs as a process that asks for the responses of its samples, line by line.

    Cheng et al. (2024), J. Open Source Softw. 9(97):6338.
"""

import json
import subprocess
from pathlib import Path

import numpy as np

from benchmarks.ways.truths import Bench
from calibration.statistics.numbers import NORMAL_95

NAME = "GrainLearning"
SAMPLES = 11
"""Of an iteration: 22, 47 and 92 runs are 2, 4 and 8 whole iterations (22, 44 and 88 runs)."""
ESS = 0.3  # effective sample size that its filter aims at, as in its own examples
CLIENT = Path(__file__).with_name("grain_learning_client.py")


def started(python: str | Path) -> subprocess.Popen[str]:
    """Start a Python (path) that has GrainLearning; a context, at whose end it ends."""
    call = [python, str(CLIENT)]
    return subprocess.Popen(call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def answer(
    process: subprocess.Popen[str], bench: Bench, runs: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Its estimated parameters (3,), the mean of its weighted samples, and low, high (3,): 1.96
    standard deviations about it, within the region. None where it ends with an error."""

    def say(**message):
        print(json.dumps(message), file=process.stdin, flush=True)

    say(measured=bench.measured, iterations=runs // SAMPLES, samples=SAMPLES, ess=ESS)
    while "ask" in (told := json.loads(process.stdout.readline())):  # type: ignore[union-attr]
        say(values=bench.run(_coded(told["ask"])).tolist())
    if "error" in told:
        return None
    samples, weight = _coded(told["samples"]), np.array(told["weight"])
    mean = weight @ samples
    reach = NORMAL_95 * np.sqrt(weight @ (samples - mean) ** 2)
    low, high = np.clip([mean - reach, mean + reach], -1.0, 1.0)
    return mean, low, high


def _coded(u):
    return 2.0 * np.array(u) - 1.0
