"""Heaps at rest: angle, height and grains, from their places."""
