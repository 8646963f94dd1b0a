"""How often the diagnosis finds what is hidden in tables, and how often it claims what is not
there: `python -m benchmarks.rates`."""
