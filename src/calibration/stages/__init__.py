"""The stages of the chain: each reads its input files and writes its output files.

They hold no statistics of their own; those are in `calibration.statistics`.
"""

from calibration.stages.ascent import analyse_ascent, plan_ascent
from calibration.stages.files import read_region
from calibration.stages.optimum import augmented_runs, optimise, plan_candidate
from calibration.stages.posterior import analyse_posterior
from calibration.stages.response_surface import analyse_response_surface, plan_response_surface
from calibration.stages.screening import analyse_screening, plan_screening
from calibration.stages.validation import analyse_validation, plan_validation

__all__ = [
    "analyse_ascent",
    "analyse_posterior",
    "analyse_response_surface",
    "analyse_screening",
    "analyse_validation",
    "augmented_runs",
    "optimise",
    "plan_ascent",
    "plan_candidate",
    "plan_response_surface",
    "plan_screening",
    "plan_validation",
    "read_region",
]
