"""The kinds of terms: each module beside this one has `terms(readings, known)`, which gives the
terms of one experiment; nothing else lists them."""

import importlib
import pkgutil


def all_terms(readings, known):
    """[`Term`] of every kind for the `Readings` of one experiment; known: {name: `Known`} curves of
    the catalogue."""
    modules = [
        importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)
    ]
    return [term for module in modules for term in module.terms(readings, known)]
