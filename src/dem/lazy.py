"""Modules that are loaded when something of them is first used: a schema must not wait a second for
the engine."""

import importlib.util
import sys


def lazily(name):
    """The module `name`; its code runs at the first access to one of its attributes."""
    if name in sys.modules:
        return sys.modules[name]
    found = importlib.util.find_spec(name)
    found.loader = importlib.util.LazyLoader(found.loader)
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    found.loader.exec_module(module)
    return module
