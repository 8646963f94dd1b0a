"""What a study says before any run (what was read, what is valid but risky) and at its end."""

from pathlib import Path

from calibration.config import point_spec, read_back
from calibration.factors import read_factors
from dem.spec import parse_spec


def opening(config):
    """Sentences: the measured values of each target as they were read, then the engine's warnings.

    Raises ConfigError for a table that cannot be read.
    """
    found = [f"read {text}" for text in read_back(config)]
    factors = read_factors(config.factors)
    levels = {f.key: f.value(config.fixed.get(f.name, f.natural(0.0))) for f in factors}
    spec = parse_spec(point_spec(config.run, config.experiment, levels, config.seed))
    return found + [f"warning: {text}" for text in _warnings(spec)]


def _warnings(spec):
    """The engine's warnings of a run with every factor at its fixed level, else at its middle."""
    from dem.advice import warnings_of  # loads the engine

    return warnings_of(spec)


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
