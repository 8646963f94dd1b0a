"""Discrete element engine for spheres: Hertz-Mindlin contacts, numba kernels, SI units."""

from dem.kernel_cache import use_kernel_cache

use_kernel_cache()
