"""Text out of jinja templates: a file `NAME.j2` beside the modules that use it holds macros."""

from functools import cache
from typing import Any

from calibration.statistics.numbers import fixed


def capital(text: str) -> str:
    """With a capital letter first, the others as they are."""
    return text[:1].upper() + text[1:]


@cache
def environment(package: str, filters: tuple[tuple[str, Any], ...] = ()) -> Any:
    """Return what the templates of a package are read in.

    The filter `fmt` is Python's `format`, and `fixed` writes a number with its decimals; filters:
    further ones (name, function)."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # most commands need none

    own = Environment(
        loader=PackageLoader(package, "."), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    own.filters |= {"capital": capital, "fmt": format, "fixed": fixed} | dict(filters)
    return own


@cache
def macros(package: str, name: str, filters: tuple[tuple[str, Any], ...] = ()) -> Any:
    """The macros of `NAME.j2` of a package, as functions that give text, in its `environment`."""
    return environment(package, filters).get_template(f"{name}.j2").module


def words(name: str) -> Any:
    """The `macros` of a code, or of what several codes have in common."""
    return macros("calibration.engines", name)
