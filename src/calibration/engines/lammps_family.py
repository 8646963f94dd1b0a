"""What LIGGGHTS and LAMMPS have in common: LIGGGHTS began as a copy of LAMMPS, so their decks are
written and what they leave is read in the same way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from calibration.engines import rig
from calibration.engines.program import read_dump, read_frames, state_of
from calibration.engines.rigs import Dialect, experiments_of, rigs

if TYPE_CHECKING:
    from dem.spec import RunSpec


@dataclass(frozen=True)
class Code:
    """One of the two, in its own words."""

    block: ModuleType
    """Module that writes its material block."""
    material: str
    """Name of the file of this block."""
    main: str
    """Name of the deck."""
    dialect: Dialect
    own: Mapping[str, Callable[[Any, Path], str]]
    """{experiment: f(spec, folder)} for heap and drop: text of a deck; f writes what it reads."""
    made: Callable[[str], int]
    """made(output): number of grains that a heap's source made."""

    @property
    def experiments(self) -> tuple[str, ...]:
        """Experiments that it can run."""
        return (*self.own, *experiments_of(self.dialect))

    def write(self, spec: RunSpec, folder: Path, material: str | None = None) -> None:
        """Write deck and material block of a `RunSpec` into `folder`, and the files that they read.

        material: text of the block, that of the spec unless given."""
        (folder / self.material).write_text(material or rig.block_of(self.block, spec))
        if spec.experiment in rigs():
            text = rigs()[spec.experiment].deck(spec, self.dialect, folder)
        else:
            text = self.own[spec.experiment](spec, folder)
        (folder / self.main).write_text(text)

    def read(
        self, spec: RunSpec, folder: Path, output: str
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Metrics and last state of a run, from what it left in `folder` and its output. Raises
        EngineError."""
        if spec.experiment in rigs():
            return rigs()[spec.experiment].read(spec, folder, output)
        if spec.experiment == "drop":
            drop = rig.Drop.of(spec)
            frames = read_frames(folder / "trace.dump")
            z, v = (np.array([f[name] for f in frames]) for name in ("z", "vz"))
            return drop.metrics(z, v, drop.starts(spec.seed)[:, 2]), {}
        state = state_of(read_dump(folder / "end.dump"))
        return rig.heap_metrics(state, rig.Pour.of(spec), self.made(output)), state
