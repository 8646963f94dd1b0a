"""What LIGGGHTS and LAMMPS have in common: LIGGGHTS began as a copy of LAMMPS, so their decks are
written and what they leave is read in the same way."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibration.engines import rig
from calibration.engines.program import read_dump, read_frames, state_of
from calibration.engines.rigs import rigs
from calibration.engines.templates import words
from dem.constants import GRAVITY
from dem.spec import RunSpec
from dem.walls.builder import WallSet


@dataclass(frozen=True)
class Code:
    """One of the two, in its own words: the template of its name."""

    name: str
    block: Callable[..., str]
    """Writes its material block."""
    material: str
    """Name of the file of this block; the deck is `in.` and the code's name."""
    walls: Callable[..., str]
    """walls(bodies, folder, moves=None, lid=None): the bodies of a `WallSet`; moves: the name of
    one that `words.lift` moves, lid: the `Lid` among them."""
    heap: Callable[[Any, Path], str]
    """heap(spec, folder): text of a heap's deck; writes what it reads."""
    made: Callable[[str], int]
    """made(output): number of grains that a heap's source made."""

    @property
    def experiments(self) -> tuple[str, ...]:
        """Experiments that it can run."""
        return ("heap", "drop", *rigs())

    @property
    def words(self) -> Any:
        """Its macros. A rig asks for `lift`, `hold`, `turn`, `stop` and `watch` of a body, and of a
        `Lid` for its `height` and for `load`, which presses it with the variable `force`."""
        return words(self.name)

    def head(self, spec: RunSpec, space: str, radius: float) -> str:
        """Units, laws and gravity; space: lines that make the box, radius: of the smallest grain
        [m]."""
        text: str = self.words.head(spec.experiment, space, 0.2 * radius, GRAVITY)
        return text

    def remove(self, walls: WallSet, name: str) -> str:
        """Take a body away."""
        others = [b["name"] for b in walls.bodies if b["name"] != name]
        text: str = self.words.remove(name, others)
        return text

    def write(self, spec: RunSpec, folder: Path, material: str | None = None) -> None:
        """Write deck and material block of a `RunSpec` into `folder`, and the files that they read.

        material: text of the block, that of the spec unless given."""
        (folder / self.material).write_text(material or rig.block_of(self.block, spec))
        if spec.experiment in rigs():
            text = rigs()[spec.experiment].deck(spec, self, folder)
        else:
            text = self.heap(spec, folder) if spec.experiment == "heap" else self._drop(spec)
        (folder / f"in.{self.name}").write_text(text)

    def _drop(self, spec):
        drop = rig.Drop(spec)
        at, (first, every, looks) = drop.starts(spec.seed), drop.looks
        places = [" ".join(f"{x:.12g}" for x in place) for place in at]
        box = self.words.box(rig.box_around(at, drop.radius))
        text = self.words.drop(drop, places, first, every, every * looks)
        return self.head(spec, box, drop.radius) + text

    def read(
        self, spec: RunSpec, folder: Path, output: str
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Metrics and last state of a run, from what it left in `folder` and its output. Raises
        EngineError."""
        if spec.experiment in rigs():
            return rigs()[spec.experiment].read(spec, folder, output)
        if spec.experiment == "drop":
            drop = rig.Drop(spec)
            frames = read_frames(folder / "trace.dump")
            z, v = (np.array([f[name] for f in frames]) for name in ("z", "vz"))
            return drop.metrics(z, v, drop.starts(spec.seed)[:, 2]), {}
        state = state_of(read_dump(folder / "end.dump"))
        return rig.heap_metrics(state, rig.Pour(spec), self.made(output)), state


def pour_box(pour: rig.Pour) -> str:
    """Bounds of the box of a heap, as a deck writes them."""
    side = 1.5 * max(pour.rig.plate_radius, pour.rig.mouth_radius)
    ends = (-side, side, -side, side, pour.bottom, pour.top + pour.largest)
    return " ".join(f"{x:.6g}" for x in ends)
