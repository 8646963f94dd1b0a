"""Provenance: the study as an RO-Crate, with all of its runs in one file."""

from calibration.study.stages.stage import Stage

CRATE = "provenance"
"""Folder of a study's results that holds copies of the others."""

STAGES = (Stage(name=CRATE, title="Provenance", place=9.9),)
