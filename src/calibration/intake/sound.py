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

from calibration.errors import decoding
from calibration.files import write_table
from calibration.intake.measurements import readings_table
from calibration.intake.quantities import LEVERS
from calibration.intake.tables import refused
from dem.constants import GRAVITY
from dem.tables.limits import LONGEST_SOUND_S, check_file

LOWEST_MM = LEVERS["drop_height_mm"].least  # of a drop that a table may hold
LOUD = 8.0  # times the recording's quiet level: an impact
APART_S = 0.02  # between two impacts; a flight of 20 ms is half a millimetre high
SMOOTH_S = 0.001
LEAST = 3  # impacts: two flights, one restitution
ENOUGH = 3  # restitutions of several recordings that show a scatter
SHORT_S = 2.0 * APART_S  # flights from here on run into each other: the train ends before
RATES = (4_000, 400_000)
"""Samples a second of what records bounces."""
ASSUMED_SCATTER = 0.1
"""Of the restitution from bounce to bounce, where there are two flights and nothing else to tell
it. It is assumed and said so; three recordings show it."""
ONSET_S = 3e-4
"""Error of the moment of an impact, as the tests hold it."""
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


def read_train(path: str | Path) -> Train:
    """`Train` of a WAV file, up to the first flight that is too short to be told from the next one.
    Raises ConfigError for a file that is none, and for sounds that are not those of one grain
    coming to rest."""
    path = Path(path)
    heard = _impacts(*_read(path))
    flights = np.diff(heard)
    short = np.flatnonzero(flights < SHORT_S)
    train = Train(path, heard[: short[0] + 1] if len(short) else heard)
    facts = {"number": len(train.times), "least": LEAST, "short": 1e3 * SHORT_S}
    if len(train.times) < LEAST and len(short):
        facts |= {"height": _height_mm(SHORT_S), "longest": 1e3 * flights.max()}
        raise refused("short flights", path, **facts)
    if len(train.times) < LEAST:
        raise refused("few impacts", path, **facts)
    growing = np.flatnonzero(train.restitution >= 1.0)
    if len(growing):
        first, second = 1e3 * train.flights[growing[0] : growing[0] + 2]
        at = train.times[growing[0] + 1]
        raise refused("growing flight", path, at=at, first=first, second=second)
    return train


def _height_mm(flight):
    return 1e3 * GRAVITY * flight**2 / 8.0


def measure_sounds(paths: Sequence[str | Path], out: Path | None = None) -> list[str]:
    """Lines to print: each recording's restitution, then all of them. Writes the table `out` of
    drops and rebounds; each flight is used once, so that the rows are independent. Raises
    ConfigError."""
    if out is not None and out.exists():
        raise refused("exists", out)
    trains, lines = [read_train(path) for path in paths], []
    every = np.concatenate([t.restitution for t in trains])
    for train in trains:
        alone = len(train.restitution) == 1 and len(every) < ENOUGH
        told = f"{train.path.name}: {len(train.times)} impacts, {_said(train.restitution)}"
        lines.append(f"{told}. {_single(train)}" if alone else told)
    if len(trains) > 1:
        lines.append(f"together: {_said(every)}")
    if out is not None:
        write_table(pd.concat([_table(t, every) for t in trains], ignore_index=True), out)
        lines.append(f"wrote {out}: rows for the study's table of measured values")
    return lines


def _single(train):
    """How far two flights alone can be trusted, and the height that gives three."""
    e, first = float(train.restitution[0]), float(train.flights[0])
    factor = (SHORT_S / e**2 / first) ** 2  # the third flight is then clear
    higher = f", or drop it from {factor:.1f} times as high for a third" if factor > 1.0 else ""
    return (
        f"Two flights show no scatter of their own: ± {_single_sd(train):.3f} is assumed "
        f"({100 * ASSUMED_SCATTER:g} %). Give three recordings or more, which show it{higher}"
    )


def _single_sd(train):
    """Standard deviation of the restitution of two flights: what is assumed of bounces, and the
    moments of the three impacts."""
    e, first = float(train.restitution[0]), float(train.flights[0])
    heard = np.sqrt(2.0) * ONSET_S * np.sqrt(1.0 + e**2) / first
    return float(np.hypot(ASSUMED_SCATTER * e, heard))


def _said(ratios):
    if len(ratios) == 1:
        return f"restitution {ratios[0]:.3f} (1 impact between two flights)"
    return (
        f"restitution {ratios.mean():.3f} ± {ratios.std(ddof=1):.3f} ({len(ratios)} impacts "
        f"between two flights)"
    )


def _table(train, every):
    """Rows of drops: a flight's height and that of the next one, with the spread that the
    restitution has within the recording, or where that has two flights in all of them (every)."""
    e, heights = train.restitution, _height_mm(train.flights)
    rises = heights[1::2]
    falls = heights[:-1:2][: len(rises)]
    notes = [f"{train.path.name}, flights {2 * k + 1} and {2 * k + 2}" for k in range(len(rises))]
    shown = e if len(e) > 1 else every
    sd = shown.std(ddof=1) if len(e) > 1 or len(every) >= ENOUGH else _single_sd(train)
    spread = 2.0 * sd / e.mean() * rises
    table = readings_table("drop", "rebound_height", rises.round(4), "mm", notes)
    table = table.assign(sd=spread.round(4), n=1, drop_height_mm=falls.round(4))
    return table[falls >= LOWEST_MM]


def _read(path):
    """(samples a second, one channel of the sound as floats). Raises ConfigError where a file is no
    recording of a length that a grain's bounces have."""
    with decoding(path, "a WAV file: PCM or float"):
        check_file(path, "sound")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # further chunks of recorders
            rate, sound = wavfile.read(path)
        sound = np.asarray(sound if sound.ndim == 1 else sound.mean(axis=1), float)
    if not RATES[0] <= rate <= RATES[1]:
        value = f"{rate} samples a second"
        raise refused("sound's rate", path, value=value, least=RATES[0], most=RATES[1])
    if len(sound) > LONGEST_SOUND_S * rate:
        raise refused("long sound", path, value=f"{len(sound) / rate:.0f} s", most=LONGEST_SOUND_S)
    if not np.isfinite(sound).all():
        raise refused("no samples", path)
    largest = float(np.abs(sound).max(initial=0.0))
    return rate, sound / largest if largest > 0.0 else sound


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
