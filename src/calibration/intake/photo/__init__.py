"""Angles of repose out of photographs: silhouette, base line, and the simulation's own flank
fit."""
