"""Speed of the engine: `python -m benchmarks.speed`."""
