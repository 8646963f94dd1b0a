"""Text out of jinja templates: a file `NAME.j2` beside the modules that use it holds macros."""

from functools import cache
from typing import Any

from calibration.statistics.numbers import fixed


@cache
def macros(package: str, name: str, filters: tuple[tuple[str, Any], ...] = ()) -> Any:
    """The macros of `NAME.j2` of a package, as functions that give text.

    The filter `fmt` is Python's `format`, and `fixed` writes a number with its decimals; filters:
    further ones (name, function)."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # most commands need none

    environment = Environment(
        loader=PackageLoader(package, "."), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    environment.filters |= {"fmt": format, "fixed": fixed} | dict(filters)
    return environment.get_template(f"{name}.j2").module


def words(name: str) -> Any:
    """The `macros` of a code, or of what several codes have in common."""
    return macros("calibration.engines", name)
