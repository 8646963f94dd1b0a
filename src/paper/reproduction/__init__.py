"""The reproduction of the paper: every table and equation, its value, ours with its spread, and the
agreement."""
