"""Angles of repose out of photographs: silhouette, base line, and the simulation's own flank
fit."""

from calibration.intake.photo.measure import measure_photo

__all__ = ["measure_photo"]
