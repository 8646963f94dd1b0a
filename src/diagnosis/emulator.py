"""The emulators of a diagnosis: a `Response` for one experiment under one law, trained by DEM runs.

What is known of the experiment transforms the reading, so that a nearly linear rest is learned:
log(rebound / height) is 2 log e, tan(sliding angle) is mu, shear stress over normal stress is a
friction.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.study.factors import Factor
from diagnosis.catalogue import Strength
from diagnosis.design import inputs_of, multiplied, wanted
from diagnosis.response import Response, WithMechanism
from diagnosis.scale import scale_of
from diagnosis.settings import BASE, Settings, catalogue_of, log_span

LEAST = 2
"""Finished runs of a mechanism that train it: what they do not tell is in the
variance, and strong cohesion clogs a silo at most strengths."""


@dataclass(frozen=True)
class Moved:
    """Emulator of what a run of the base model with one input moved tells: of a mechanism that
    multiplies a lever, of a law along one.

    move: has the `column` that it moves, `moved(x)`: inputs (k, d) of the base model from those
    (k, d + 1) here, the coded strength last, and `slopes(x)`: {column of x: derivatives (k,) of
    what is added to the moved input}."""

    base: Response
    move: Any

    def with_slope(
        self, x: np.ndarray, columns: Sequence[int], error: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """As `Response.with_slope`; the last input is the coded strength. x: (k, d + 1)."""
        own = [c for c in columns if c != x.shape[1] - 1]
        z, found, variance = self.base.with_slope(
            self.move.moved(x), [*own, self.move.column], error
        )
        slope, by = np.zeros((len(x), len(columns))), self.move.slopes(x)
        for k, c in enumerate(columns):
            if c in own:
                slope[:, k] = found[:, own.index(c)]
            if c in by:
                slope[:, k] += found[:, -1] * by[c]
        return z, slope, variance

    def correlation(self, x: np.ndarray) -> np.ndarray:
        """As `Response.correlation`. x: (k, d + 1)."""
        return self.base.correlation(self.move.moved(x))


def train(
    rows: Sequence[dict[str, Any]],
    metrics: Mapping[str, Mapping[str, float] | None],
    settings: Settings,
    factors: Sequence[Factor],
) -> tuple[dict[tuple[str, str], Any], list[dict[str, Any]]]:
    """{(experiment, mechanism): Response} and a table of their errors.

    rows: of `design.plan`; metrics: {run id: metrics or None}. A run that failed trains nothing
    and is counted. Runs of the base model train a mechanism too, at the strength at which it does
    nothing. One that multiplies a lever has no emulator but the base model's.
    """
    emulators, table = {}, []  # type: ignore[var-annotated]
    known = catalogue_of(settings, list(settings.experiments))
    finished, planned = _finished(rows, metrics)
    for key, own in finished.items():
        done = sum(len(r["run_ids"]) for r in own)
        if done < (0.5 * planned[key] if key[1] == BASE else LEAST):
            row = {"experiment": key[0], "mechanism": key[1], "runs": done}
            table.append(row | {"failed": planned[key] - done})
            continue
        base = emulators.get((key[0], BASE))
        names = inputs_of(settings, factors, *key)
        x, z = _responses(key[0], own, metrics, settings, names)
        if key[1] == BASE:
            levers = settings.experiments[key[0]].levers
            emulators[key] = Response(x, z, [names.index(n) for n in levers])  # type: ignore[union-attr]  # `derived` fills it in
        elif base is None:
            continue  # most of the base model's runs failed, which the table says
        else:
            emulators[key] = WithMechanism(base, x, z, coded_off(known[key[1]].strength))
        table.append(
            {
                "experiment": key[0],
                "mechanism": key[1],
                "runs": done,
                "failed": planned[key] - done,
                "error": emulators[key].error,
                "scatter": emulators[key].scatter,
                "spread": emulators[key].spread,
            }
        )
    for experiment, name in wanted(settings, known, dict.fromkeys(e for e, _ in finished)):
        lever = multiplied(settings, factors, experiment, known.get(name))
        if lever and (experiment, BASE) in emulators:
            emulators[experiment, name] = Moved(emulators[experiment, BASE], lever)  # type: ignore[arg-type, assignment]
    return emulators, table


def _finished(rows, metrics):
    """{(experiment, mechanism): rows with the runs that did not fail, those without any left out},
    and how many runs were planned of each."""
    finished, planned = defaultdict(list), defaultdict(int)
    for row in rows:
        key = row["experiment"], row["mechanism"]
        ran = [n for n in row["run_ids"] if metrics[n] is not None]
        planned[key] += len(row["run_ids"])
        finished[key] += [row | {"run_ids": ran}] if ran else []
    return finished, planned


def rows_at_strength(coded: float, base: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the base model as rows of a mechanism at a coded strength. Rows at levers beyond the
    range are left out."""
    inside = [r for r in base if 0.0 <= min(r["inputs"]) and max(r["inputs"]) <= 1.0]
    return [r | {"inputs": [*r["inputs"], coded]} for r in inside]


def coded_off(strength: Strength) -> float | None:
    """Coded strength at which a mechanism does nothing; None where its range does not reach so
    far."""
    if strength.off is not None:
        return strength.coded(strength.off)
    return 0.0 if not strength.log and strength.low == 0.0 else None


def _responses(experiment, rows, metrics, settings, names):
    """Inputs (n, d) and transformed responses (n,) of the runs of rows, each by itself."""
    runs = [(r["inputs"], name) for r in rows for name in r["run_ids"]]
    x = np.array([inputs for inputs, _ in runs])
    own = settings.experiments[experiment]
    ranges = own.levers
    levers = {n: np.array([log_span(*ranges[n], s) for s in x[:, names.index(n)]]) for n in ranges}
    value = np.array([metrics[name][own.metric] for _, name in runs])
    return x, scale_of(experiment).forward(value, levers)
