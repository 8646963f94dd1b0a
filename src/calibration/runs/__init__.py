"""Runs: planned, made, kept under their content, checked at each read, and counted."""
