"""Kept libraries beside the project's ways, where they are installed: a Bayesian optimiser, and
simulation-based inference. Nothing else needs them; docs/evidence.md has their versions.

    bayesian-optimization, github.com/bayesian-optimization/BayesianOptimization.
    sbi: Boelts et al. (2025), J. Open Source Softw. 10(108):7754.
"""

from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import qmc

from benchmarks.ways.truths import Bench
from benchmarks.ways.ways import CODES, CUBE, intervals
from calibration.errors import CalibrationError

STARTED = 16  # space-filling runs, as many as the project's ways begin with
FEWEST = 11  # of a round of simulation-based inference


def library_optimiser(bench: Bench, runs: int) -> tuple[np.ndarray, None, None]:
    """`BayesianOptimization` of the library of that name, with its defaults: it maximises the
    negative distance of single runs from the measured mean. Returns the coded point (3,) that its
    `max` names, the best run; it states no interval."""
    from bayes_opt import BayesianOptimization

    def near(**x):
        return -abs(float(bench.run(np.array([[x[c] for c in CODES]]))[0]) - bench.measured)

    seed = int(bench.rng.integers(2**31))
    bounds = dict.fromkeys(CODES, (-1.0, 1.0))
    search = BayesianOptimization(near, bounds, random_state=seed, verbose=0)
    search.maximize(init_points=STARTED, n_iter=runs - STARTED)
    return np.array([search.max["params"][c] for c in CODES]), None, None


def neural_likelihood(bench: Bench, runs: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sequential neural likelihood of `sbi` with its defaults, in two rounds: half of the runs fill
    the space, the others are draws of the posterior so far. A single run is the observation, as its
    simulator gives one. Returns the mean of the posterior and its 95 % intervals, coded, (3,)
    each."""
    import torch
    from sbi.inference import NLE
    from sbi.utils import BoxUniform
    from torch.utils.tensorboard import SummaryWriter

    torch.manual_seed(int(bench.rng.integers(2**31)))
    torch.set_num_threads(1)
    first = max(runs // 2, FEWEST)
    x = 2.0 * qmc.Sobol(3, seed=bench.rng).random(64)[:first] - 1.0
    box = BoxUniform(-torch.ones(3), torch.ones(3))
    with TemporaryDirectory() as logs:  # it would write them into the working folder
        learner = NLE(box, show_progress_bars=False, summary_writer=SummaryWriter(logs))
        weight = _learnt(learner, x, bench, torch)
        x = CUBE[bench.rng.choice(len(CUBE), runs - first, p=weight)]
        weight = _learnt(learner, x, bench, torch)
    return weight @ CUBE, *intervals(weight)


def _learnt(learner, x, bench, torch):
    """Posterior probability (n,) of the cube's grid points after further runs at x (n, 3)."""
    y = bench.run(x)[:, None]
    tensors = (torch.as_tensor(v, dtype=torch.float32) for v in (x, y))
    network = learner.append_simulations(*tensors).train(max_num_epochs=500)
    points = torch.as_tensor(CUBE, dtype=torch.float32)
    seen = torch.full((1, len(CUBE), 1), bench.measured, dtype=torch.float32)
    with torch.no_grad():
        log = network.log_prob(seen, points)[0].double().numpy()
    if not np.isfinite(log).any():
        raise CalibrationError("the learnt likelihood is zero everywhere")
    weight = np.exp(log - log.max())
    return weight / weight.sum()


LIBRARIES = {
    "bayesian-optimization": library_optimiser,
    "sbi, neural likelihood": neural_likelihood,
}
