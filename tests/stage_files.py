"""Input and output files of a stage, as snakemake hands them to it."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple


class Files(SimpleNamespace):
    """Files by name; iterated and indexed in their order."""

    def get(self, name, default=None):
        """The file of a name, or a default."""
        return getattr(self, name, default)

    def __iter__(self):
        return iter(vars(self).values())

    def __getitem__(self, n):
        return list(self)[n]


class PlanFiles(NamedTuple):
    """The two files of a plan of runs."""

    design: Path
    plan: Path

    @classmethod
    def of(cls, folder):
        """Those in a folder."""
        return cls(Path(folder) / "design.csv", Path(folder) / "plan.json")


def write(path, content):
    """Write a text, or a mapping as JSON, and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))
