"""Runs of one point side by side."""

from calibration.figures.labels import ANGLE
from calibration.figures.style import BLUE, subplots


def spread_of_seeds(values, response=ANGLE):
    """A point for each run and a line at their mean; values (n,) in the unit of the response."""
    figure, ax = subplots()
    ax.scatter(range(1, len(values) + 1), values, color=BLUE)
    ax.axhline(values.mean(), color=BLUE, lw=1)
    ax.set(xlabel="run", ylabel=response.axis)
    return figure
