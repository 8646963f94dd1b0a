"""The configuration of a study: schema, checks, its measured values and the run specs that it
describes."""

from calibration.study.config.measured import read_back, read_swept, read_target
from calibration.study.config.parse import given, parse_config, stands_alone, with_engine
from calibration.study.config.schema import METRICS, Config
from calibration.study.config.specs import numbers_of, overlay, point_spec, states, with_levels
from calibration.study.factors import section_of

__all__ = [
    "METRICS", "Config", "given", "numbers_of", "overlay", "parse_config", "point_spec",
    "read_back", "read_swept", "read_target", "section_of", "stands_alone", "states", "with_engine",
    "with_levels",
]  # fmt: skip
