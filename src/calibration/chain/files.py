"""Files that several stages read or write."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.files import read_json
from calibration.study.config import Config
from calibration.study.factors import Factor

if TYPE_CHECKING:
    from calibration.chain.handed_over import NamedFiles
    from calibration.study.config.schema import Target


def read_region(path: str | Path) -> list[Factor]:
    """Factors with the levels of a region: of a region.json, or of an optimum.json the one that it
    was sought in."""
    content = read_json(path)
    return [Factor(**f) for f in (content["region"] if "region" in content else content)]


def each_file(paths: Iterable[str | Path]) -> list[Path]:
    """Files of a rule's paths, those in its folders one by one."""
    found = []
    for path in map(Path, paths):
        found += sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    return found


def further_files(config: Config, output: NamedFiles) -> Iterable[tuple[Target, str, str]]:
    """(target, file, figure) of each further target; nothing with one target."""
    if not config.further_targets:
        return ()
    return zip(config.further_targets, output.further, output.further_figures, strict=True)
