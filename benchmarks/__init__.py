"""What developers measure: speed, other codes, the diagnosis' rates, ways to calibrate compared."""
