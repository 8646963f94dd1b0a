"""Discrete element engine for spheres: Hertz-Mindlin contacts, numba kernels, SI units."""
