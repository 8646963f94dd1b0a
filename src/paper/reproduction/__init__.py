"""The reproduction of the paper: every table and equation, its value, ours with its spread, and the
agreement."""

from paper.reproduction.table import counts, reproduce, write_reproduction

__all__ = ["counts", "reproduce", "write_reproduction"]
