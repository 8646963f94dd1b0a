"""Blocks of input for other codes: a material and its laws in the words of each.

One file a code, each with the conventions of that code and their source; docs/other-codes.md works
them out.
"""
