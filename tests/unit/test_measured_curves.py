"""Measured curves become coefficients of their shape with their covariance; wrong ones are refused
by line."""

from pathlib import Path

import numpy as np
import pytest

from calibration.errors import ConfigError
from calibration.intake.curves import read_curves
from facts import refused


def curve_table(path, curves, header="curve,x,y"):
    rows = [f"{n},{a},{b}" for n, (x, y) in enumerate(curves) for a, b in zip(x, y, strict=True)]
    Path(path).write_text("\n".join([header, *rows]) + "\n")


def test_a_discharge_s_curves_give_flow_and_time_with_their_covariance(tmp_path):
    """Straight lines of known flow: what differs between the curves is the covariance, that of
    their mean; a faster one is empty earlier."""
    flows = np.array([40.0, 42.0, 44.0, 46.0])
    time = np.linspace(0.0, 4.0, 401)
    curves = [(time, np.minimum(f * time, 100.0)) for f in flows]
    curve_table(tmp_path / "c.csv", curves)
    found = read_curves(tmp_path / "c.csv", "mass over time")
    assert found.metrics == ("mass_flow_g_s", "emptying_time_s")
    assert found.mean == pytest.approx([43.0, np.mean(100.0 / flows)], abs=0.02)
    assert found.covariance[0, 0] == pytest.approx(flows.var(ddof=1) / 4, rel=1e-3)
    assert found.covariance[0, 1] / np.sqrt(np.prod(np.diag(found.covariance))) < -0.99
    assert found.freedom == 2
    scaled = [(1e3 * x, y) for x, y in curves]
    curve_table(tmp_path / "ms.csv", scaled, "curve,x (ms),y (g)")
    assert read_curves(tmp_path / "ms.csv", "mass over time").mean == pytest.approx(found.mean)


def test_curves_of_shear_compression_and_outline_give_their_coefficients(tmp_path):
    x = np.linspace(0.0, 10.0, 101)
    shear = [(x, (2.0 + k / 10) * np.minimum(x / 2.0, 1.0)) for k in range(4)]
    curve_table(tmp_path / "s.csv", shear)
    assert read_curves(tmp_path / "s.csv", "stress over displacement").mean == pytest.approx(
        [2.15, 2.15], abs=1e-6
    )
    stress = np.linspace(0.0, 50.0, 101)
    curve_table(tmp_path / "p.csv", [(stress, stress / (1000.0 + 10 * k)) for k in range(4)])
    strain, modulus = read_curves(tmp_path / "p.csv", "strain over stress").mean
    assert strain == pytest.approx(np.mean([50.0 / (1000 + 10 * k) for k in range(4)]))
    assert modulus == pytest.approx(1015.0, rel=1e-3)
    across = np.linspace(-60.0, 60.0, 241)
    heaps = [
        (across, np.maximum((20.0 + k) - np.abs(across - 5) * np.tan(np.radians(25)), 0.0))
        for k in range(4)
    ]
    curve_table(tmp_path / "o.csv", heaps)
    found = read_curves(tmp_path / "o.csv", "outline")
    assert found.mean == pytest.approx([25.0, 21.5], abs=0.2)


def test_angles_over_speed_are_read_at_the_speeds_that_are_simulated(tmp_path):
    """Straight lines, so that what lies between two speeds is known; a speed beyond all is
    refused."""
    speeds = np.array([5.0, 10.0, 30.0])
    curves = [(speeds, 25.0 + k + 0.1 * speeds) for k in (-1.0, 0.0, 0.5, 1.0)]
    curve_table(tmp_path / "c.csv", curves, "curve,x (rpm),y (deg)")
    found = read_curves(tmp_path / "c.csv", "angle over speed", (36.0, 120.0))
    assert found.metrics == ("dynamic_angle_deg",) * 2
    assert found.mean == pytest.approx([25.725, 27.125])
    assert found.covariance == pytest.approx(np.full((2, 2), np.var([-1, 0, 0.5, 1], ddof=1) / 4))
    with refused(ConfigError, path="c.csv", line=2, column="curve"):
        read_curves(tmp_path / "c.csv", "angle over speed", (36.0, 200.0))


def test_a_discharge_that_takes_no_time_is_refused_without_a_warning(tmp_path):
    """All of the mass has left at the time 0; a warning of numpy would fail this test."""
    time = np.concatenate([[0.0], np.arange(9.0)])
    mass = np.concatenate([[0.0], np.full(9, 5.0)])
    curve_table(tmp_path / "at_once.csv", [(time, mass)] * 3)
    with refused(ConfigError, "mass_flow_g_s", path="at_once.csv", line=2, column="curve"):
        read_curves(tmp_path / "at_once.csv", "mass over time")
