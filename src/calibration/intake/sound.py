"""Restitution from a sound recording of a bouncing grain: the times between its impacts.

A flight that lasts T reaches g T^2 / 8. The restitution of the impact between two flights is the
ratio of their durations (C. E. Aguiar, F. Laudares 2003, American Journal of Physics 71:499,
arXiv physics/0210092, after Bernstein 1977, the same 45:41). Nothing but times is taken from the
recording, so its loudness and its microphone do not matter. Air drag is neglected: it changes the
heights in second order only.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import wavfile
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from calibration.errors import CalibrationError
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.quantities import LEVERS
from dem.constants import GRAVITY

LOWEST_MM = LEVERS["drop_height_mm"].least  # of a drop that a table may hold
LOUD = 8.0  # times the recording's quiet level: an impact
APART_S = 0.02  # between two impacts; a flight of 20 ms is half a millimetre high
SMOOTH_S = 0.001
LEAST = 4  # impacts: three flights, two restitutions
SHORT_S = 2.0 * APART_S  # flights from here on run into each other: the train ends before
ONSET = 0.3  # of the peak at which an impact begins


@dataclass(frozen=True)
class Train:
    """Impacts of one recording: path and times (n,) [s]."""

    path: Path
    times: np.ndarray

    @property
    def flights(self) -> np.ndarray:
        """Durations (n - 1,) [s] between the impacts."""
        return np.diff(self.times)

    @property
    def restitution(self) -> np.ndarray:
        """Restitution (n - 2,) of the impacts between two flights."""
        return self.flights[1:] / self.flights[:-1]

    @property
    def heights_mm(self) -> np.ndarray:
        """Heights (n - 1,) of the flights."""
        return 1e3 * GRAVITY * self.flights**2 / 8.0


def read_train(path: str | Path) -> Train:
    """`Train` of a WAV file. Raises CalibrationError for a file that is none, and for sounds that
    are not those of one grain coming to rest."""
    path = Path(path)
    rate, sound = _read(path)
    train = Train(path, _clear(_impacts(rate, sound)))
    if len(train.times) < LEAST:
        raise CalibrationError(
            f"{path}: {len(train.times)} impacts are heard above the noise; allowed: at least "
            f"{LEAST} of one grain that bounces on the spot"
        )
    growing = np.flatnonzero(train.restitution >= 1.0)
    if len(growing):
        k = int(growing[0])
        first, second = train.flights[k : k + 2]
        raise CalibrationError(
            f"{path}: the flight from {train.times[k + 1]:.3f} s lasts {1e3 * second:.1f} ms, the "
            f"one before {1e3 * first:.1f} ms; allowed: shorter and shorter flights of one grain "
            f"(cut the recording to them)"
        )
    return train


def _clear(times):
    """The impacts up to the first flight that is too short to be told from the next one."""
    short = np.flatnonzero(np.diff(times) < SHORT_S)
    return times[: short[0] + 1] if len(short) else times


def measure_sounds(paths: Sequence[str | Path], out: Path | None = None) -> list[str]:
    """Lines to print: each recording's restitution, then all of them. Writes the table `out` of
    drops and rebounds; each flight is used once, so that the rows are independent. Raises
    CalibrationError."""
    if out is not None and out.exists():
        raise CalibrationError(f"{out}: exists already")
    trains, lines = [read_train(path) for path in paths], []
    for train in trains:
        lines.append(f"{train.path.name}: {len(train.times)} impacts, {_said(train.restitution)}")
    if len(trains) > 1:
        lines.append(f"together: {_said(np.concatenate([t.restitution for t in trains]))}")
    if out is not None:
        write_table(pd.concat([_table(t) for t in trains], ignore_index=True), out)
        lines.append(f"wrote {out}: rows for the study's table of measured values")
    return lines


def _said(ratios):
    return (
        f"restitution {ratios.mean():.3f} ± {ratios.std(ddof=1):.3f} ({len(ratios)} impacts "
        f"between two flights)"
    )


def _table(train):
    """Rows of drops: a flight's height and that of the next one, with the spread that the
    restitution has within the recording."""
    e, heights = train.restitution, train.heights_mm
    rises = heights[1::2]
    falls = heights[:-1:2][: len(rises)]
    notes = [f"{train.path.name}, flights {2 * k + 1} and {2 * k + 2}" for k in range(len(rises))]
    spread = 2.0 * e.std(ddof=1) / e.mean() * rises
    table = readings_table("drop", "rebound_height", rises.round(4), "mm", notes)
    table = table.assign(sd=spread.round(4), n=1, drop_height_mm=falls.round(4))
    return table[falls >= LOWEST_MM]


def _read(path):
    """(samples a second, one channel of the sound as floats)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # further chunks of recorders
            rate, sound = wavfile.read(path)
    except FileNotFoundError:
        raise CalibrationError(f"{path}: there is no such file") from None
    except (ValueError, OSError, EOFError) as error:
        raise CalibrationError(f"{path}: is no WAV file ({error}); allowed: PCM or float") from None
    sound = np.asarray(sound, float)
    return rate, sound if sound.ndim == 1 else sound.mean(axis=1)


def _impacts(rate, sound):
    """Times [s] at which impacts begin."""
    # the difference of neighbours leaves clicks and takes hum and wind away
    envelope = uniform_filter1d(np.abs(np.diff(sound)), max(1, round(SMOOTH_S * rate)))
    if not len(envelope) or envelope.max() == 0.0:
        return np.empty(0)
    quiet = max(float(np.median(envelope)), 1e-4 * float(envelope.max()))
    peaks, _ = find_peaks(envelope, height=LOUD * quiet, distance=max(1, round(APART_S * rate)))
    return np.array([_onset(envelope, peak, rate) for peak in peaks]) / rate


def _onset(envelope, peak, rate):
    """Sample at which the rise to a peak passes a share of it: loud and faint impacts alike."""
    first = max(0, peak - round(APART_S * rate / 2))
    below = np.flatnonzero(envelope[first : peak + 1] < ONSET * envelope[peak])
    if not len(below):
        return float(first)
    at = first + below[-1]
    low, high = envelope[at], envelope[min(at + 1, len(envelope) - 1)]
    return at + (ONSET * envelope[peak] - low) / (high - low) if high > low else float(at)
