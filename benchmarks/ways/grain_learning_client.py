"""Runs in a Python that has GrainLearning, and nothing of this project: studies in, samples out.

A line of JSON on standard input begins a study. A line {"ask": samples in [0, 1]} on standard
output waits for {"values": responses}. {"samples", "weight"} or {"error"} ends the study.
`BayesianCalibration.run` divides by the range of the observations, which is zero where one value
was observed. So the filter itself is called, as `run` calls it.
"""

import contextlib
import json
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from grainlearning import DynamicSystem, IterativeBayesianFilter

TALK = sys.stdout


def say(**message: Any) -> None:
    """Write a line."""
    print(json.dumps(message), file=TALK, flush=True)


def density(filtering: Any) -> np.ndarray:
    """Density (n,), of sum 1, with which the filter drew the samples of its next iteration; left
    unset, these count as drawn evenly and their weights are not those of a posterior. As its
    `load_proposal_from_file` has it from a file."""
    mixture = filtering.sampling
    scores = mixture.gmm.score_samples(mixture.normalize(filtering.param_data_list[-1]))
    own = np.exp(scores - scores.max())
    return own / own.sum()


def study(task: Mapping[str, Any]) -> tuple[list[list[float]], list[float]]:
    """One study: (samples (n, 3), weights (n,)) of the last iteration."""
    system = DynamicSystem(
        obs_data=np.array([[task["measured"]]]),
        num_samples=task["samples"],
        param_min=[0.0] * 3,
        param_max=[1.0] * 3,
        param_names=["A", "B", "C"],
    )
    inference = {"ess_target": task["ess"]}
    filtering = IterativeBayesianFilter.from_dict(
        {"Bayes_filter": inference, "sampling": {"max_num_components": 1, "random_state": 0}}
    )
    filtering.initialize(system)
    for _ in range(task["iterations"]):
        system.param_data = filtering.param_data_list[-1]
        system.num_samples = len(system.param_data)
        say(ask=system.param_data.tolist())
        values = json.loads(sys.stdin.readline())["values"]
        system.sim_data = np.array(values)[:, None, None]
        filtering.solve(system)
        filtering.proposal = density(filtering)
    return system.param_data.tolist(), filtering.posterior.tolist()


for line in sys.stdin:
    try:
        with contextlib.redirect_stdout(sys.stderr):
            samples, weight = study(json.loads(line))
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        say(error=str(error))
    else:
        say(samples=samples, weight=weight)
