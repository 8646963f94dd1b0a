"""The kinds of terms: each module beside this one has `terms(readings, known)`, which gives the
terms of one experiment; nothing else lists them."""

import importlib
import pkgutil
from collections.abc import Mapping

from diagnosis.laws.known import Known
from diagnosis.laws.readings import Readings
from diagnosis.table_model.term import Term


def all_terms(readings: Readings, known: Mapping[str, Known]) -> list[Term]:
    """[`Term`] of every kind for the `Readings` of one experiment; known: {name: `Known`} curves of
    the catalogue."""
    modules = [
        importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)
    ]
    return [term for module in modules for term in module.terms(readings, known)]
