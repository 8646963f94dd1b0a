"""Design, analysis and diagnosis of calibration experiments run on the `dem` engine."""

from importlib.metadata import version

__version__ = version("granular-calibration")


def __getattr__(name):
    if name == "Study":  # takes a second to load, which no other module need wait for
        from calibration.interface.api import Study

        return Study
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
