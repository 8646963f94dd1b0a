"""`dem benchmark`: speed of the engine on the work that it is for, beside other engines on the same
work."""
