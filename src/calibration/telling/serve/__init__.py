"""A local page of a study while it runs: progress, heaps as they finish, failures, start, stop."""

from calibration.telling.serve.server import Server, serve

__all__ = ["Server", "serve"]
