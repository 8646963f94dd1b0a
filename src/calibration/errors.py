"""Errors at the border: what was wrong, where, and what is allowed."""


class CalibrationError(Exception):
    """Base class of everything that is shown to the user as one line."""


class ConfigError(CalibrationError):
    """A configuration or data file that cannot be used."""

    def __init__(
        self, reason, *, path=None, line=None, column=None, key=None, value=None, allowed=None
    ):
        self.path, self.line, self.column, self.key = path, line, column, key
        self.reason, self.value, self.allowed = reason, value, allowed
        where = [str(path)] if path else []
        where += [f"line {line}"] if line else []
        where += [f"column {column}"] if column else []
        text = f"{', '.join(where)}: " if where else ""
        text += f"{key}: " if key else ""
        text += reason
        text += f" (got {value!r:.200})" if value is not None else ""
        text += f"; allowed: {allowed}" if allowed else ""
        super().__init__(text)


class RankDeficientError(CalibrationError):
    """A model whose terms cannot be told apart by the design."""

    def __init__(self, terms):
        self.terms = terms
        super().__init__(f"the design cannot tell these terms apart: {', '.join(terms)}")
