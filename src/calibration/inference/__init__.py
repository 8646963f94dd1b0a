"""Parameters inferred from what was measured: emulators of the responses, the posterior, what a
further measurement would tell, and a comparison of ways to calibrate. Arrays in, arrays out."""
