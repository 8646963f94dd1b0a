"""What a study says before any run (what was read, what is valid but risky), of each stage that has
run, and at its end."""

import re
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from calibration.chain.responses import without_value
from calibration.chain.study import Study
from calibration.figures import Response
from calibration.study.config import Config, point_spec, read_back
from calibration.study.factors import read_factors
from calibration.study.stage import Stage
from calibration.telling.answer.schema import answer_of
from dem.spec import parse_spec


def opening(config: Config) -> list[str]:
    """Sentences: the measured values of each target as they were read, then the engine's warnings.

    Raises ConfigError for a table that cannot be read.
    """
    factors = read_factors(config.factors)
    warnings = [*_narrow(factors), *_warnings(config, factors)]
    return [f"read {text}" for text in read_back(config)] + [f"warning: {x}" for x in warnings]


NARROW = 0.05
"""Of its larger end: a range below it moves a response by less than runs scatter."""


def _narrow(factors):
    """Sentences on factors whose ranges hold hardly more than one level."""
    for f in factors:
        largest = max(abs(f.low), abs(f.high))
        if f.high - f.low < NARROW * largest:
            yield (
                f"{f.name} goes from {f.low:g} to {f.high:g}, {(f.high - f.low) / largest:.1%} of "
                "itself: so narrow a range moves a response by less than runs scatter"
            )


def _warnings(config, factors):
    """The engine's warnings of a run with every factor at its fixed level, else at its middle, and
    what more it says where one factor is at an end of its range."""
    from dem.advice import warnings_of  # loads the engine

    def at(levels):
        return warnings_of(parse_spec(point_spec(config.own_run, config.experiment, levels, seed)))

    seed = config.seed
    levels = {f.key: config.fixed.get(f.name, f.natural(0.0)) for f in factors}
    found = at(levels)
    for f in factors:
        for end in (f.low, f.high):
            more = [text for text in at(levels | {f.key: end}) if text not in found]
            found += [f"with {f.name} at {end}: {text}" for text in more]
    return found


def closing(study: Study) -> list[str]:
    """Sentences: the answer, the page of a diagnosis, and where the report is; whatever of them is
    there."""
    found = answer_of(study)
    said = str(found).splitlines() if found else []
    verdict = study.summary("diagnosis", "verdict")
    if verdict:
        page = Path(study.folder, "diagnosis", "diagnosis.html").absolute()
        said.append(f"diagnosis: {verdict['verdict']}: {page}")
    report = Path(study.folder, "report.html").absolute()
    return [*said, *([f"report: {report}"] if report.is_file() else [])]


def sentences_of(stage: Stage, summary: Mapping[str, Any] | None, response: Response) -> list[str]:
    """Return what a stage says of its summary (a mapping, or None), which of its runs it left out,
    and what its runs say themselves."""
    if not summary:
        return []
    texts = stage.sentences(summary, response) if stage.sentences else []
    return [*texts, *without_value(summary.get("left_out", [])), *_noted(summary.get("noted", []))]


def _noted(rows):
    """A sentence for each thing that runs say of themselves, in the words of the first that says
    it: notes that differ in their numbers alone say one thing."""
    alike = defaultdict(list)
    for row in rows:
        alike[re.sub(r"[\d.]+", "", row["note"])].append(row)
    for first, *others in alike.values():
        yield f"Run {first['run']}: {first['note']}."
        if others:
            runs = ", ".join(str(row["run"]) for row in others)
            yield f"The same, with other numbers, of run{'s' if others[1:] else ''} {runs}."
