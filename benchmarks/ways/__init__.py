"""Ways to calibrate, compared at equal numbers of runs on responses whose truth is known."""
