"""The statistics of the chain: designs, effects, response surfaces, optima and comparisons.

They work on arrays and tables, and know neither the configuration nor the runs (an import-linter
contract).
"""
