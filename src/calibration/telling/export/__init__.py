"""Carrying calibrated parameters to other codes: calibrated.yaml, decks, and the search for the
angle in laws that other codes have. The blocks of codes that can run them are those of
`calibration.engines`."""
