"""Files that several stages read or write."""

import json
from pathlib import Path

from calibration.factors import Factor


def load(path):
    """Content of a JSON file."""
    return json.loads(Path(path).read_text())


def read_region(path):
    """Factors with the levels of a region: of region.json, or of an optimum.json the one that it
    was sought in."""
    content = load(path)
    return [Factor(**f) for f in (content["region"] if "region" in content else content)]


def further_files(config, output):
    """(target, file, figure) of each further target; nothing with one target."""
    if not config.further_targets:
        return ()
    return zip(config.further_targets, output.further, output.further_figures, strict=True)
