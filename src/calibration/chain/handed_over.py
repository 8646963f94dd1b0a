"""What snakemake hands to a stage's function, as a type."""

from collections.abc import Iterator
from typing import Any, Protocol


class NamedFiles(Protocol):
    """Input or output files of a rule: each attribute is the path, or the list of paths, that
    stands under this name in the rule's `input` or `output`."""

    def __getattr__(self, name: str) -> Any: ...

    def __iter__(self) -> Iterator[Any]: ...

    def get(self, name: str, default: Any = None) -> Any:
        """The path or paths of a name, `default` where the rule has none of it."""
