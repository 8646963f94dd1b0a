"""The blocks of other codes for any point of the profiler, without a second copy of their formulas.

The exports' own code writes each block at many levels of each factor. Numbers that do not change
are text of a template. A number that follows one factor becomes a table over its levels, between
which the page interpolates. A block whose numbers do not follow from such tables is left out, and
the page says so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from calibration.engines.blocks.conversion import Conversion
from calibration.engines.blocks.material import granulate
from calibration.study.config import with_levels
from calibration.telling.export.stage import CODES
from dem.errors import DemError
from dem.spec import parse_spec

if TYPE_CHECKING:
    from pathlib import Path


LEVELS = 33
AGREE = 1e-3  # relative: how well the tables must give back what the code writes elsewhere
TRIALS = 5
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\w.])")


def decks(study: Path, factors: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """{file: {text, numbers}} for the page, or {file: {refused}} where it cannot make the block.

    factors: [{key, low, high, value}]. text: pieces around the numbers that change; numbers: one
    for each gap, {factor, levels, values}. Empty without the exports' run spec.
    """
    path = study / "exports" / "dem.yaml"
    if not path.is_file():
        return {}
    spec = yaml.safe_load(path.read_text("utf-8"))
    about = [f"A point chosen in the report of {study.name}; no run has validated it."]

    def writer(code):
        def written(values):
            levels = dict(zip((f["key"] for f in factors), values, strict=True))
            mapping = parse_spec(with_levels(spec, levels))
            text = code.block(granulate(mapping), Conversion(mapping), about)
            return NUMBER.split(text), NUMBER.findall(text)

        return written

    return {name: _deck(writer(code), factors) for name, code in CODES.items()}


def _deck(written, factors):
    """A block's template. written: function of the factors' values that gives the pieces of text
    around the numbers of the block, and the numbers, as the code writes them."""
    try:
        pieces, tokens = written([f["value"] for f in factors])
        numbers = _tables(written, factors, pieces)
        _try(written, factors, tokens, numbers)
    except (DemError, ValueError) as error:
        return {"refused": str(error)}
    text = [pieces[0]]
    for i, (token, piece) in enumerate(zip(tokens, pieces[1:], strict=True)):
        if i in numbers:
            text.append(piece)
        else:
            text[-1] += token + piece
    return {"text": text, "numbers": [numbers[i] for i in sorted(numbers)]}


def _tables(written, factors, pieces):
    """{place of a number: its table} of the numbers that change. Raises ValueError."""
    numbers, centre = {}, [f["value"] for f in factors]
    for k, factor in enumerate(factors):
        levels = np.linspace(factor["low"], factor["high"], LEVELS)
        table = []
        for level in levels:
            here, tokens = written([*centre[:k], level, *centre[k + 1 :]])
            if here != pieces:
                raise ValueError("its commands change within the range of the parameters")
            table.append([float(token) for token in tokens])
        table = np.array(table)
        for i in np.flatnonzero(np.ptp(table, axis=0) > 0.0).tolist():
            if i in numbers:
                raise ValueError("a number of it depends on several of the parameters at once")
            values = table[:, i].tolist()
            numbers[i] = {"factor": k, "levels": levels.tolist(), "values": values}
    return numbers


def _try(written, factors, tokens, numbers):
    """Compare the tables with what the code writes at points of no table. Raises ValueError."""
    rng = np.random.default_rng(0)
    for _ in range(TRIALS):
        values = [rng.uniform(f["low"], f["high"]) for f in factors]
        _, found = written(values)
        for i, (fixed, true) in enumerate(zip(tokens, found, strict=True)):
            ours = float(fixed)
            if i in numbers:
                n = numbers[i]
                ours = np.interp(values[n["factor"]], n["levels"], n["values"])
            if abs(ours - float(true)) > AGREE * abs(float(true)):
                raise ValueError("a number of it does not follow from single parameters")
