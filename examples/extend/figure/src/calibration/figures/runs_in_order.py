"""What each run of a design gave."""

from calibration.figures.labels import ANGLE
from calibration.figures.style import BLUE, GREY, subplots


def runs_in_order(values, response=ANGLE):
    """A point for each run and a line at the median; values (n,) in the unit of the response, NaN
    where a run has none."""
    figure, ax = subplots()
    ax.scatter(range(1, len(values) + 1), values, color=BLUE)
    ax.axhline(values.median(), color=GREY, lw=1)
    ax.set(xlabel="run", ylabel=response.axis)
    return figure
