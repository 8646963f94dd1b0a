"""Virtual experiments: one file each, which defines `EXPERIMENT` (`dem.experiments.declare`);
nothing else lists them.

Folders of further files are named in the environment variable DEM_EXPERIMENTS, with the system's
separator of paths.

Modules of the engine that an experiment runs with are loaded when a run first uses something of
them: a schema must not wait a second for them.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import pkgutil
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import DemError
from dem.experiments.declare import Experiment

if TYPE_CHECKING:
    from types import ModuleType

    from dem.spec import RunSpec

HELPERS = ("bed", "declare", "mesh", "outflow", "phases", "setup")
FOLDERS = "DEM_EXPERIMENTS"


def lazily(name: str) -> ModuleType:
    """The module `name`; its code runs at the first access to one of its attributes."""
    if name in sys.modules:
        return sys.modules[name]
    found = importlib.util.find_spec(name)
    found.loader = importlib.util.LazyLoader(found.loader)  # type: ignore[union-attr,arg-type]
    module = importlib.util.module_from_spec(found)  # type: ignore[arg-type]
    sys.modules[name] = module
    found.loader.exec_module(module)  # type: ignore[union-attr]
    return module


bed, outflow = lazily("dem.experiments.bed"), lazily("dem.experiments.outflow")
phases, setup = lazily("dem.experiments.phases"), lazily("dem.experiments.setup")
builder, drag = lazily("dem.walls.builder"), lazily("dem.kernel.drag")


@cache
def experiments() -> dict[str, Experiment]:
    """{name: Experiment} of every file beside this one and in the folders of DEM_EXPERIMENTS, in
    order of names.

    Raises DemError for a folder that is not there and for a file that declares no new experiment.
    """
    shipped = [m.name for m in pkgutil.iter_modules(__path__) if m.name not in HELPERS]
    found = [importlib.import_module(f"{__name__}.{name}").EXPERIMENT for name in shipped]
    table = {e.name: e for e in found}
    for path in outside_files():
        experiment = _declared_in(path)
        if experiment.name in table:
            raise DemError(f"{path}: the name {experiment.name!r} is taken by another experiment")
        table[experiment.name] = experiment
    return dict(sorted(table.items()))


def experiment_of(spec: RunSpec) -> Experiment:
    """`Experiment` of a `RunSpec`."""
    return experiments()[spec.experiment]


def outside_files() -> list[Path]:
    """Paths of the files in the folders of DEM_EXPERIMENTS. Raises DemError for a folder that is
    not there."""
    files = []
    for folder in filter(None, os.environ.get(FOLDERS, "").split(os.pathsep)):
        if not Path(folder).is_dir():
            raise DemError(f"{FOLDERS}: {folder} is no folder")
        files += sorted(Path(folder).glob("[!_]*.py"))
    return files


@cache
def source_outside(name: str) -> Path | None:
    """Path of the file outside the package that declares an experiment; None for one of the
    package's own."""
    return next((path for path in outside_files() if _declared_in(path).name == name), None)


@cache
def _declared_in(path):
    spec = importlib.util.spec_from_file_location(f"experiment_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # pydantic looks a model's annotations up there
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the file is the user's
        raise DemError(f"{path}: cannot be loaded ({error})") from error
    experiment = getattr(module, "EXPERIMENT", None)
    if not isinstance(experiment, Experiment):
        raise DemError(f"{path}: declares no experiment; it must set EXPERIMENT = Experiment(...)")
    return experiment
