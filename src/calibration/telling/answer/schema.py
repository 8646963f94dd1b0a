"""The content of answer.json.

`python -m calibration.telling.answer.schema` prints it as a JSON schema, which is kept beside this
file."""

import json
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from calibration.chain.study import Results


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Parameter(_Part):
    """A parameter of the model that is handed out."""

    key: str = Field(description="of the run spec")
    name: str = Field(description="as a reader calls it")
    symbol: str | None = Field(description="of the field, where there is one")
    value: float | str
    unit: str
    interval_95: tuple[float, float] | None = Field(description="null where nobody computed one")
    interval_of: Literal["all tests", "one test", "one test, others held"] | None
    bounded: bool | None = Field(description="by what was measured; null where not calibrated")
    source: Literal["calibrated", "measured", "published", "fixed", "default"]


class Test(_Part):
    """A measured row, or a prediction of what nobody has measured, at the parameters handed out."""

    __test__ = False  # no test of pytest

    test: str
    metric: str
    setting: dict[str, float] = Field(description="levers of the row")
    unit: str
    measured: float | None
    error: float | None = Field(description="standard error of the measured mean")
    n: int | None = Field(description="readings behind it")
    predicted: float | None = Field(description="mean of the runs")
    predicted_sd: float | None = Field(description="standard error of that mean")
    interval_95: tuple[float, float] | None = Field(description="of a further run, by the draws")
    runs: int
    pull: float | None = Field(description="measured less predicted, over their common error")
    p: float | None = Field(
        description="of so large a pull, times the rows judged; the calibrated alone"
    )
    state: Literal["met", "missed", "not judged", "not simulated", "prediction"]
    note: str = Field(description="why it is not judged or not simulated, or how near it is")


class Instead(_Part):
    """What another test of the study says of a parameter that was not calibrated to it."""

    parameter: str
    handed_out: float
    found: float = Field(description="by the bench test of its own")
    test: str
    metric: str = Field(description="of the study's own test")
    change: float | None = Field(description="of it with the level found, measured by runs")
    change_95: tuple[float, float] | None
    runs: int


class Beside(_Part):
    """A calibrated parameter beside what all tests together give."""

    parameter: str
    handed_out: float
    all_tests_95: tuple[float, float]
    inside: bool


class Wrong(_Part):
    """What of the measurements speaks against the parameters handed out."""

    verdict: str = Field(description="met, missed or not judged, or the diagnosis' own")
    p: float | None = Field(description="the least of the rows', or the diagnosis' own")
    laws: list[str] = Field(description="that the diagnosis names")
    rows: list[str] = Field(description="measured rows that are missed")
    instead: list[Instead]
    sentence: str


class Next(_Part):
    """The measurement that is expected to tell most."""

    test: str
    metric: str
    readings: int
    hours: float
    parameter: str
    left: float = Field(description="share of the parameter's spread that it leaves")


class Runs(_Part):
    """Runs of the calibration and of the predictions here."""

    made: int
    failed: int
    seconds: float = Field(description="of one core")


class Answer(_Part):
    """The answer of a study."""

    study: str
    engine: str
    by: Literal["chain", "joint"] = Field(
        description="chain: calibrated to one test; joint: to all of them together"
    )
    parameters: list[Parameter]
    tests: list[Test]
    wrong: Wrong
    beside: list[Beside]
    next: Next | None
    runs: Runs

    def __str__(self) -> str:
        from calibration.telling.answer.words import said  # loads the figures

        return "\n".join(said("lines", self))

    __repr__ = __str__


def answer_of(results: Results) -> Answer | None:
    """The answer in a study's results, None before the stage has run."""
    found = results.summary("answer")
    return None if found is None else Answer.model_validate(found)


if __name__ == "__main__":
    print(json.dumps(Answer.model_json_schema(), indent=1))
