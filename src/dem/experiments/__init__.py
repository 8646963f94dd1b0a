"""Virtual experiments: each module has `run(spec, context)` that returns the experiment's metrics."""
