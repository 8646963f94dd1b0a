"""Angles of repose out of photographs: silhouette, base line, and the simulation's own flank
fit."""

from calibration.intake.photo.measure import HeapPhoto, measure_photo
from calibration.intake.photo.show import draw_fit

__all__ = ["HeapPhoto", "draw_fit", "measure_photo"]
