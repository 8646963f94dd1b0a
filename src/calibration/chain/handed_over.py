"""What snakemake hands to a stage's function and to the script that calls it, as types."""

from collections.abc import Iterator, Mapping
from typing import Any, Protocol


class NamedFiles(Protocol):
    """Input or output files of a rule: each attribute is the path, or the list of paths, that
    stands under this name in the rule's `input` or `output`."""

    def __getattr__(self, name: str) -> Any: ...

    def __iter__(self) -> Iterator[Any]: ...

    def get(self, name: str, default: Any = None) -> Any:
        """The path or paths of a name, `default` where the rule has none of it."""


class Job(Protocol):
    """The job that runs a script: its log files, the study's configuration, checked and as a
    mapping, and what stands in its rule's `input`, `output` and `params`."""

    log: list[str]
    config: Mapping[str, Any]
    input: NamedFiles
    output: NamedFiles
    params: NamedFiles
