"""Rules of the diagnosis taken out or turned round, one at a time, while it runs: the default tests
of strangers' tables must fail with each.

    python tests/discovery/mutants.py            all of them
    python tests/discovery/mutants.py NAME ...   those alone

A mutant is killed by the first table that is not judged as it must be. One that no table kills is
named, and the script ends with 1.
"""

import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np
import test_strangers_verdicts as test_verdicts

from benchmarks.rates.strangers import cases
from diagnosis import withdrawal
from diagnosis.laws import known
from diagnosis.table_model import found, selection
from diagnosis.table_model.terms import laws as law_terms
from diagnosis.table_model.terms import level_offsets, one_level, order, resolution, rows


@dataclass(frozen=True)
class Mutant:
    """patches: (module, name, what stands there instead). tables: kinds that are tried first."""

    name: str
    patches: tuple
    tables: tuple


def nothing(*_, **__):
    return []


def _without_simulation(blocks, count, seed):
    return np.full(count, -1e9)


def _unnamed(block, key, original=found.named):
    return replace(original(block, key), names=[])


def _best_of_the_catalogue(block, key, original=found.named):
    own = original(block, key)
    return replace(own, names=[own.nearest], forms=[]) if own.nearest else own


def _inverted(*arguments, original=known._known):
    own = original(*arguments)
    return own and replace(own, curves=-own.curves)


def _one_law(*arguments, original=selection.select, **more):
    return original(*arguments, **{**more, "most": 1})


def _first_experiment(blocks, original=selection._best):
    return original(dict([next(iter(blocks.items()))]))


def _p(value):
    def misfit(*arguments, original=selection.misfit, **more):
        return original(*arguments, **more) | {"p": value}

    return misfit


def _no_covariate(readings, original=law_terms.applicable):
    return [law for law in original(readings) if not set(law.state) & set(readings.covariates)]


def _none_is_open(row):
    return False


def _undeclared(*arguments, original=found.readings_of, **more):
    readings = original(*arguments, **more)
    declared = {"batch", "instrument"}
    return replace(readings, groups={k: v for k, v in readings.groups.items() if k not in declared})


LAW_TABLES = ("seen after a slip", "air")
MUTANTS = (
    Mutant("null simulation dropped", ((selection, "of_chance", _without_simulation),),
           ("two rates, four sizes", "plain both, 3 levels")),
    Mutant("level errors off", ((level_offsets, "terms", nothing),),
           ("error between two tilt rates", "camera set up for each height")),
    Mutant("rivals never sought", ((selection, "rivals", nothing),),
           ("error between two tilt rates", "late hand, 2 rates")),
    Mutant("left-out check off", ((withdrawal, "_against", lambda gain: None),), ()),
    Mutant("nothing nameable", ((found, "named", _unnamed),), LAW_TABLES),
    Mutant("catalogue's sign inverted", ((known, "_known", _inverted),), LAW_TABLES),
    Mutant("a name need not beat the other forms", ((found, "named", _best_of_the_catalogue),),
           ("v^-0.6, 4 levels",)),
    # invented from the documentation of the method
    Mutant("one step at most", ((selection, "select", _one_law),), ("v^-0.25 and late hand",)),
    Mutant("the first experiment alone", ((selection, "_best", _first_experiment),),
           ("v^-0.25 and late hand",)),
    Mutant("no misfit", ((selection, "misfit", _p(1.0)),), ("late hand, 4 levels",)),
    Mutant("always a misfit", ((selection, "misfit", _p(0.001)),), ("two rates, four sizes",)),
    Mutant("adequate without a look at the misfit", ((found, "MISFIT", 0.0),),
           ("error from setting to setting",)),
    Mutant("rows trusted", ((rows, "terms", nothing),), ("one row, drops",)),
    Mutant("no further column is a state", ((law_terms, "applicable", _no_covariate),),
           ("humidity, drops",)),
    Mutant("order of the rows ignored", ((order, "terms", nothing),), ("wear in random order",)),
    Mutant("no single level is wrong", ((one_level, "terms", nothing),), ("132 mm for 120",)),
    Mutant("digits ignored", ((resolution, "terms", nothing), (found, "_rounded", nothing)),
           ("means written to 5 mm",)),
    Mutant("batches ignored", ((found, "readings_of", _undeclared),), ("declared batches",)),
    Mutant("rivals do not count", ((found, "_open", _none_is_open),),
           ("error between two tilt rates", "late hand, 2 rates")),
    Mutant("no next measurement", ((found, "propose", lambda *_: None),),
           ("late hand, 2 rates", "error between two tilt rates")),
)  # fmt: skip
BY_NAME = {m.name: m for m in MUTANTS}


def killer(mutant):
    """What kills a mutant; None where it lives."""
    tables = sorted(cases.FIXED, key=lambda c: _rank(mutant, c))
    test_verdicts.of.cache_clear()
    with ExitStack() as stack:
        for module, name, instead in mutant.patches:
            stack.enter_context(patch.object(module, name, instead))
        try:
            for test in test_verdicts.BY_HAND:
                if _fails(test):
                    return test.__name__
            return next((c.name for c in tables if _fails(test_verdicts.check, c)), None)
        finally:
            test_verdicts.of.cache_clear()


def _rank(mutant, case):
    return mutant.tables.index(case.kind) if case.kind in mutant.tables else len(mutant.tables)


def _fails(test, *arguments):
    try:
        test(*arguments)
    except AssertionError:
        return True
    return False


def main(names):
    alive = []
    for mutant in [BY_NAME[n] for n in names] or MUTANTS:
        by = killer(mutant)
        print(f"{mutant.name}: {f'killed by {by}' if by else 'LIVES'}", flush=True)
        alive += [] if by else [mutant.name]
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
