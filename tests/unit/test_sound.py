"""Restitution from the sound of a bouncing grain: recordings whose impacts are known."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from calibration.errors import CalibrationError
from calibration.intake.measurements import read_measured
from calibration.intake.sound import SHORT_S, measure_sounds, read_train
from calibration.interface.commands import main
from dem.constants import GRAVITY
from facts import refused

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


@pytest.mark.parametrize("restitution", [0.5, 0.62, 0.74, 0.9])
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


@pytest.mark.parametrize("restitution", [0.55, 0.65, 0.8])
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


def test_two_channels_and_floats_are_read(tmp_path):
    recording(tmp_path / "a.wav", 0.7)
    rate, mono = wavfile.read(tmp_path / "a.wav")
    both = np.column_stack([mono, mono]).astype(np.float32) / 32768
    wavfile.write(tmp_path / "b.wav", rate, both)
    assert read_train(tmp_path / "b.wav").restitution.mean() == pytest.approx(0.7, rel=0.01)


def test_what_is_no_train_of_one_grain_is_refused_in_words(tmp_path):
    with refused(CalibrationError, "none.wav"):
        read_train(tmp_path / "none.wav")
    (tmp_path / "text.wav").write_text("time,impact\n0.1,1\n")
    with refused(CalibrationError, "WAV"):
        read_train(tmp_path / "text.wav")
    wavfile.write(tmp_path / "silence.wav", 8000, np.zeros(8000, np.int16))
    with refused(CalibrationError, "silence.wav", "0 impacts", "4"):
        read_train(tmp_path / "silence.wav")
    recording(tmp_path / "few.wav", 0.7, impacts=3)
    with refused(CalibrationError, "few.wav", "3 impacts", "4"):
        read_train(tmp_path / "few.wav")
    recording(tmp_path / "one.wav", 0.7)
    rate, sound = wavfile.read(tmp_path / "one.wav")
    wavfile.write(tmp_path / "two.wav", rate, np.concatenate([sound, sound]))
    with refused(CalibrationError, "300.0 ms", "42.0 ms"):
        read_train(tmp_path / "two.wav")


def test_the_command_tells_the_shipped_examples_restitution(capsys):
    """The example is made, not measured: its README says so, and how."""
    assert main(["bounce", str(EXAMPLE)]) == 0
    assert "restitution 0.62" in capsys.readouterr().out
    assert main(["bounce", "none.wav"]) == 2
    assert "there is no such file" in capsys.readouterr().err
