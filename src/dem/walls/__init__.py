"""Walls: how they are described, how they move, and where grains touch them."""
