"""Grains: their sizes, and the bodies that stand for them."""
