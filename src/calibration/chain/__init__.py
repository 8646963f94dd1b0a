"""The chain from screening to validation: each function reads its input files and writes its output
files.

They hold no statistics of their own; those are in `calibration.statistics`.
`calibration.study.stages` declares what each reads and writes.
"""
