"""What a study says before any run (what was read, what is valid but risky) and at its end."""

from pathlib import Path

from calibration.config import point_spec, read_back
from calibration.factors import read_factors
from dem.spec import parse_spec

MATERIAL = ("materials", "contacts")
"""Parts of a run spec that say what the material is."""


def opening(config):
    """Sentences: the measured values of each target as they were read, then the engine's warnings.

    Raises ConfigError for a table that cannot be read.
    """
    found = [f"read {text}" for text in read_back(config)]
    factors = read_factors(config.factors)
    levels = {f.key: config.fixed.get(f.name, f.centre) for f in factors}
    given = point_spec(config.run, config.experiment, levels, config.seed)
    spec = parse_spec(given)
    return found + [f"warning: {text}" for text in (*_warnings(spec), *_unsaid(spec, given))]


def _warnings(spec):
    """The engine's warnings of a run with every factor at its fixed level, else at its middle."""
    from dem.advice import warnings_of  # loads the engine

    return warnings_of(spec)


def _unsaid(spec, given):
    """A sentence on the material's own numbers that neither `run` nor a factor gives: those of the
    engine's example then count, which are another material's."""
    used = _numbers(spec.model_dump(include=set(MATERIAL)))
    found = [f"{key} {value:g}" for key, value in used.items() if key not in _numbers(given)]
    return [f"not given, so the engine's example counts: {', '.join(found)}"] if found else []


def _numbers(data, prefix=""):
    """{dotted key: value} of the numbers in a nested mapping."""
    found = {}
    for key, value in data.items():
        if isinstance(value, dict):
            found |= _numbers(value, f"{prefix}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[f"{prefix}{key}"] = value
    return found


def closing(study):
    """Sentences: the verdict of a diagnosis with its page, and where the report is; whatever of
    them is there."""
    found = []
    verdict = study.summary("diagnosis", "verdict")
    if verdict:
        causes = " and ".join(name.replace("_", " ") for name in verdict["causes"])
        page = Path(study.folder, "diagnosis", "diagnosis.html").absolute()
        found.append(f"diagnosis: {verdict['verdict']}{f' ({causes})' if causes else ''}: {page}")
    report = Path(study.folder, "report.html").absolute()
    return [*found, *([f"report: {report}"] if report.is_file() else [])]
