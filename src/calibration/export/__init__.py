"""Carrying calibrated parameters to other codes: calibrated.yaml, and a block of input for each
code.

One file a code, each with the conventions of that code and their source; docs/howto-export.md works
them out.
"""
