"""How the package is called: the commands `calibration` and `dem`, and `Study` in Python."""
