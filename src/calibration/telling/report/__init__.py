"""The study's report: one HTML file that opens offline."""

from calibration.telling.report.build import build

__all__ = ["build"]
