"""Runs that no engine changes: what the tests of the analysis read."""

from pathlib import Path

FROZEN = Path(__file__).parent / "frozen_runs"
