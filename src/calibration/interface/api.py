"""The public interface in Python: open a study, run its stages, take its results as tables.

The paths in a configuration count from one folder, the study's root. A study finds it, so that a
notebook may lie anywhere.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, chdir, nullcontext
from dataclasses import dataclass
from functools import cached_property
from os.path import abspath
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.chain import study
from calibration.errors import CalibrationError, ConfigError
from calibration.figures import response_of
from calibration.runs.snakemake_command import LOGGER, call, snakemake_command
from calibration.statistics.equivalence import Stated
from calibration.study.config import overlay, stands_alone
from calibration.study.config.parse import parse_resolved
from calibration.study.factors import Factor
from calibration.study.stage import load_stages
from calibration.telling.answer.schema import Answer, answer_of
from calibration.telling.sentences import sentences_of
from dem.io.mapping import read_mapping
from dem.tables.limits import check_file
from dem.units import unit_of

DEFAULT = Path("config/config.yaml")
MOST_ROWS = 20
"""Of a table that is shown."""
NOT_YET = "not yet"
IN_THE_TARGET_S_UNIT = ("response", "response_sd", "effect")


class Study(study.Study):
    """A study of a folder with a config.yaml, or of configuration files, later ones laid over
    earlier ones.

    Study("wheat"), Study("wheat", resolution="quick"), Study("soybean") in the folder that holds
    it. Raises ConfigError as the workflow does.

    root: the folder that its paths count from and that its results stand in; unless given the
    current one, or the nearest above from which its factors are found; resolution: `quick` or
    `test` for fewer grains, as `--config resolution=quick` beside the study's command.
    """

    def __init__(
        self, *files: str | Path, root: str | Path | None = None, resolution: str | None = None
    ) -> None:
        given = [_read(f) for f in files]
        found = root or next(filter(None, (_root_above(*g) for g in given)), None)
        self.root = None if found is None or Path(found).samefile(".") else Path(abspath(found))
        self.files = [Path(abspath(f)) if self.root else f for f, _ in given]
        mappings = [mapping for _, mapping in given]
        with self._in_root():
            if not any(stands_alone(f) for f in self.files):
                self.files.insert(0, DEFAULT)
                mappings.insert(0, read_mapping(DEFAULT)[0])
            data: dict[str, Any] = {}
            for path, mapping in zip(self.files, mappings, strict=True):
                _check_place(path, mapping)
                data = overlay(data, mapping)
            if resolution:
                data["resolution"] = resolution
            super().__init__(parse_resolved(data, self.files))
        self.folder = (self.root or Path()) / self.folder
        self._changes = ["--config", f"resolution={resolution}"] if resolution else []

    def command(self, *arguments: str) -> list[str]:
        """The command that runs the study's workflow in its root, with further arguments of
        snakemake's."""
        return snakemake_command(self.files, *self._changes, *arguments)

    def _in_root(self) -> AbstractContextManager[Any]:
        """The study's root as the current folder, where it is another one."""
        return chdir(self.root) if self.root else nullcontext()

    @cached_property
    def factors(self) -> list[Factor]:
        """The factors of the table, in its order. Raises ConfigError."""
        with self._in_root():
            return super().factors

    def measured(self) -> np.ndarray | Stated:
        """(n,) readings of the target, or a `Stated` mean of them. Raises ConfigError."""
        with self._in_root():
            return super().measured()

    def run(
        self, stage: str, cores: int = 2, progress: Callable[[str], object] | None = print
    ) -> "StageResults":
        """Make a stage, and what it needs and is missing; returns its `StageResults`.

        cores: jobs at the same time; progress: takes a line for each step, None for none. Raises
        CalibrationError with what snakemake said last where it fails.
        """
        with self._in_root():
            command = self.command("--logger", LOGGER, f"-j{cores}", stage)
            done = call(command, each=progress or (lambda line: None))
        if done.returncode:
            said = "\n".join(done.stdout.strip().splitlines()[-20:])
            raise CalibrationError(f"{self.name}: {stage} failed\n{said}")
        return self.results(stage)

    def plot(self, stage: str, name: str | None = None) -> "Figures":
        """The figures of a stage, as a notebook shows them; name: of one, `pareto`.

        Raises CalibrationError where there is none.
        """
        if stage not in load_stages():
            allowed = ", ".join(load_stages())
            raise CalibrationError(f"{self.name}: {stage} is no stage; allowed: {allowed}")
        found = sorted((self.folder / stage).glob("*.svg"))
        chosen = [path for path in found if name in (None, path.stem)]
        if not chosen:
            allowed = ", ".join(path.stem for path in found) or f"none yet; run {stage} first"
            raise CalibrationError(
                f"{self.name}: {stage} has no figure {name or ''}; it has: {allowed}"
            )
        return Figures(chosen)

    def results(self, stage: str) -> "StageResults":
        """Return what a stage has left, see `StageResults`."""
        return StageResults(self, stage)

    def table(self, stage: str, name: str) -> pd.DataFrame | None:
        """Table `name`.csv of a stage (pandas), or None; `attrs["units"]` has the unit of each
        column that has one."""
        found = super().table(stage, name)
        if found is not None:
            found.attrs["units"] = {c: u for c in found if (u := self._unit(c))}
        return found

    def _unit(self, column):
        named = self.config.target if column in IN_THE_TARGET_S_UNIT else column
        return unit_of(named)

    @property
    def answer(self) -> Answer | None:
        """Return what the study found: `parameters`, `tests`, `wrong`, `next`; None before the
        stage answer has run. It prints as a table."""
        return answer_of(self)

    def __repr__(self) -> str:
        answer = self.answer
        done = [f"  {text}" for text in (str(answer).splitlines() if answer else [])]
        stages = [(stage.title, self._found(stage)) for stage in load_stages().values()]
        done += [f"  {title}: {found}" for title, found in stages if found != NOT_YET]
        left = ", ".join(title for title, found in stages if found == NOT_YET)
        return "\n".join([f"Study {self.name}: {self.folder}", *done, f"  {NOT_YET}: {left}"])

    def _found(self, stage):
        """Return what a stage says of itself in a line."""
        summary = self.summary(stage.name)
        if not summary:
            return NOT_YET
        said = sentences_of(stage, summary, response_of(self.config.target))
        return " ".join(said) or "done"


@dataclass(frozen=True)
class Figures:
    """Figures of a stage (SVG), which a notebook shows."""

    paths: list[Path]

    def _repr_html_(self):
        return "".join(path.read_text("utf-8") for path in self.paths)


class StageResults:
    """Summary and tables of one stage."""

    def __init__(self, owner: Study, stage: str) -> None:
        self.study, self.stage = owner, stage

    @property
    def summary(self) -> dict[str, Any] | None:
        """The stage's summary as a mapping, or None before it has run."""
        return self.study.summary(self.stage)

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """{name: table (pandas)} of the stage."""
        paths = sorted((self.study.folder / self.stage).glob("*.csv"))
        return {p.stem: self.study.table(self.stage, p.stem) for p in paths}

    def __repr__(self) -> str:
        shown = [
            f"{name}\n{_short(table).to_string(index=False, max_rows=MOST_ROWS)}"
            for name, table in self.tables.items()
        ]
        stage = load_stages().get(self.stage)  # None of one that another package declares
        said = self.study._found(stage) if stage else ""
        return "\n\n".join([f"{self.study.name}, {self.stage}: {said}", *shown])


def _short(table):
    """A table as it is shown: its name first, columns without a value left out, numbers with four
    digits. The file and `Study.table` have all of them."""
    shown = table.dropna(axis="columns", how="all")
    first = [column for column in ("name",) if column in shown]
    shown = shown[[*first, *(c for c in shown if c not in (*first, "run_id"))]]
    return shown.map(lambda x: f"{x:.4g}" if isinstance(x, float) else x)


def config_file(name: str | Path) -> Path:
    """The configuration file that a name stands for, whose paths count from the current folder.
    Raises ConfigError."""
    path, mapping = _read(name)
    _check_place(path, mapping)
    return path


def _read(name):
    """(configuration file that a name stands for, its mapping). Raises ConfigError."""
    path = Path(name)
    path = path / "config.yaml" if path.is_dir() else path
    if not path.is_file():
        raise ConfigError("is no study", path=name, allowed="a folder with config.yaml, or a file")
    check_file(path, "configuration")
    mapping = read_mapping(path)[0]
    if not isinstance(mapping, dict):
        raise ConfigError("is no mapping", path=path, allowed="a YAML mapping of keys")
    return path, mapping


def _check_place(path, mapping):
    """Raise ConfigError where a study's factors are not found from here, but from a folder above
    it: the paths in a configuration count from where the command is started."""
    there = _root_above(path, mapping)
    if there:
        named = mapping["factors"]
        allowed = f"the same command in the folder {there}, which its paths count from"
        raise ConfigError("is not here", path=path, key="factors", value=named, allowed=allowed)


def _root_above(path, mapping):
    """The nearest folder above a configuration from which its factors are found, None where they
    are found from the current one, or nowhere."""
    named = mapping.get("factors")
    if not isinstance(named, str) or Path(named).exists():
        return None
    return next((above for above in Path(abspath(path)).parents if (above / named).is_file()), None)
