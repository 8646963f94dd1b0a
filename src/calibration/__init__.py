"""Design, analysis and diagnosis of calibration experiments run on the `dem` engine."""
