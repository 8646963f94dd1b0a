"""Diagnosis: where the calibrated model fails measured data, which missing mechanism explains it,
and what that gains."""
