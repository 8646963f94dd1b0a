"""Provenance: the study as an RO-Crate, with all of its runs in one file."""

from calibration.runs.all_runs import CRATE
from calibration.study.stage import Stage

STAGES = (Stage(name=CRATE, title="Provenance", place=9.9),)
