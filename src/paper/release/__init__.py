"""A release's data: what the engine of a release computes, made anew by one command, and the pages
that are written from it. No test of the analysis reads it; those read tests/frozen_runs."""
