"""A local page of a study while it runs: progress, heaps, failures, start, stop; or of a new one: a
form."""

from calibration.telling.serve.server import Server, serve

__all__ = ["Server", "serve"]
