"""Restitution from the sound of a bouncing grain: recordings whose impacts are known."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from calibration.intake.measurements import read_measured
from calibration.intake.sound import SHORT_S, measure_sounds, read_train
from calibration.interface.commands import main
from dem.constants import GRAVITY

EXAMPLE = Path("data/instruments/bounce_made.wav")


def recording(path, restitution, impacts=7, first_s=0.25, rate=44100, noise=0.0, kind=np.int16):
    """Clicks that ring for a few milliseconds at the impacts of a grain; returns their times."""
    flights = first_s * restitution ** np.arange(impacts - 1)
    times = 0.1 + np.concatenate([[0.0], np.cumsum(flights)])
    t = np.arange(int(rate * (times[-1] + 0.2))) / rate
    sound = np.zeros_like(t)
    for k, at in enumerate(times):
        after = np.clip(t - at, 0.0, None)
        loud = restitution**k  # as the speed of the impact
        sound += loud * (t >= at) * np.exp(-after / 0.003) * np.sin(2 * np.pi * 3000 * after)
    sound += noise * np.random.default_rng(1).normal(size=len(t))
    sound += 0.05 * np.sin(2 * np.pi * 50 * t)  # hum
    scaled = 0.7 * sound / np.abs(sound).max()
    wavfile.write(path, rate, (scaled * np.iinfo(kind).max).astype(kind))
    return times


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.parametrize("rate", [16000, 44100])
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_the_restitution_of_a_known_train_comes_back(tmp_path, restitution, rate, noise):
    path = tmp_path / "a.wav"
    times = recording(path, restitution, impacts=5, rate=rate, noise=noise)
    train = read_train(path)
    heard = len(train.times)  # the faintest may drown in the noise
    clear = 1 + (np.diff(times) >= SHORT_S).sum()
    assert heard == clear if noise == 0.0 else heard >= clear - 1
    assert np.diff(train.times) == pytest.approx(np.diff(times[:heard]), abs=3e-4)
    assert train.restitution.mean() == pytest.approx(restitution, rel=0.01)


@pytest.mark.parametrize("restitution", [0.55, 0.8])
def test_a_recording_down_to_rest_gives_the_restitution(tmp_path, restitution):
    """The last flights are too short to be told from each other, and would look long."""
    recording(tmp_path / "a.wav", restitution, impacts=30, first_s=0.4)
    assert read_train(tmp_path / "a.wav").restitution.mean() == pytest.approx(restitution, rel=0.01)


def test_a_table_of_drops_is_what_the_configuration_reads(tmp_path):
    times = recording(tmp_path / "a.wav", 0.7, impacts=6)
    lines = measure_sounds([tmp_path / "a.wav"], tmp_path / "drops.csv")
    assert lines[0].startswith("a.wav: 6 impacts, restitution 0.700 ± ")
    rows = read_measured(str(tmp_path / "drops.csv"))
    heights = 1e3 * GRAVITY * np.diff(times) ** 2 / 8
    found = [(r.levers["drop_height_mm"], r.value) for r in rows.of("drop", "rebound_height")]
    assert found == [
        pytest.approx(pair, rel=0.01) for pair in zip(heights[:-1:2], heights[1::2], strict=False)
    ]


def test_the_command_tells_the_shipped_examples_restitution(capsys):
    """The example is made, not measured: its README says so, and how."""
    assert main(["bounce", str(EXAMPLE)]) == 0
    assert "restitution 0.62" in capsys.readouterr().out
    assert main(["bounce", "none.wav"]) == 2
    assert "No such file" in capsys.readouterr().err


def test_two_flights_are_taken_with_a_wider_interval_that_is_said_to_be_assumed(tmp_path):
    """A grain of restitution 0.3 has no third flight that can be told."""
    recording(tmp_path / "a.wav", 0.3, impacts=6, first_s=0.2)
    train = read_train(tmp_path / "a.wav")
    assert len(train.flights) == 2
    assert train.restitution == pytest.approx([0.3], rel=0.02)
    lines = measure_sounds([tmp_path / "a.wav"], tmp_path / "drops.csv")
    assert "assumed" in lines[0]
    assert "4.9 times as high" in lines[0]  # (40 ms / 0.3^2 / 200 ms)^2
    (row,) = read_measured(str(tmp_path / "drops.csv")).of("drop", "rebound_height")
    assert row.sd == pytest.approx(0.2 * row.value, rel=0.02)  # twice 10 % of the restitution


def test_several_recordings_of_two_flights_show_their_scatter(tmp_path):
    paths = [tmp_path / f"{n}.wav" for n in range(4)]
    for n, (path, e) in enumerate(zip(paths, (0.28, 0.3, 0.32, 0.3), strict=True)):
        recording(path, e, impacts=4, first_s=0.2 + 0.005 * n)
    lines = measure_sounds(paths, tmp_path / "drops.csv")
    assert not any("assumed" in line for line in lines)
    rows = read_measured(str(tmp_path / "drops.csv")).of("drop", "rebound_height")
    scatter = np.std([0.28, 0.3, 0.32, 0.3], ddof=1)
    assert rows[1].sd / rows[1].value == pytest.approx(2 * scatter / 0.3, rel=0.1)
