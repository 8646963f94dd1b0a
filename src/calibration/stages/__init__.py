"""The stages of a study: one module for each, or for those that belong together.

A module holds all of a stage but its rules: the function that plans its runs, the one that analyses
them, its figures, its sentences, and at its end the declaration STAGES. The functions are called
with `(study, source, output)` by the rules in `workflow/rules`. They hold no statistics of their
own; those are in `calibration.statistics`.
"""
