"""What the figures of all stages share: names and units as a reader sees them, panels of pairs of
factors, and how a figure is written. Their look stands in `figures.mplstyle`.

matplotlib, which takes a second to load, is loaded when the first one is drawn.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from calibration.statistics.numbers import fixed
from dem.io.files import replace_file, rows_of
from dem.units import behind, unit_of, without_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

    from calibration.statistics.factor import Factor

Drawing: TypeAlias = "Figure"

OF_A_PAIR = re.compile(
    r"(?P<one>[^_]+)_(?P<other>[^_]+)_"
    r"(?P<what>restitution|static_friction|rolling_friction|surface_energy|cohesion_energy_density)"
)
POISSON = re.compile(r"((?P<of>[^_]+)_)?poisson_ratio")
WORDS: dict[str, dict[str, str]] = {}
"""{of what: {name in the code: what a reader calls it}}, from `names.csv`; of metrics those whose
own names, written apart, would name no quantity."""
for _row in rows_of(Path(__file__).with_name("names.csv")):
    WORDS.setdefault(_row["of"], {})[_row["key"]] = _row["words"]
PLACES = WORDS["place"]
"""Part of a run spec -> what a reader calls it."""


def label(name: str) -> str:
    """Readable form of a factor's or another name: `salt_steel_rolling_friction` is "rolling
    friction of salt on steel"."""
    pair, poisson = OF_A_PAIR.fullmatch(name), POISSON.fullmatch(name)
    if pair:
        return f"{pair['what']} of {pair['one']} on {pair['other']}".replace("_", " ")
    if poisson:
        return "Poisson's ratio" + (f" of {poisson['of']}" if poisson["of"] else "")
    return name.replace("_", " ")


def parameter_words(key: str) -> str:
    """Return what a key of the run spec is called where a study's own name for it would mislead, as
    in a diagnosis of other grains: 'restitution, grain on wall'."""
    place = next((p for p in PLACES if key.startswith(f"{p}.")), None)
    if place is None:
        return label(without_unit(key))
    name = label(without_unit(key.removeprefix(f"{place}.")))
    return f"{name}, {PLACES[place]}"


@dataclass(frozen=True)
class Response:
    """What a study calibrates, for labels: its name and its unit as written behind a number."""

    name: str
    unit: str

    @property
    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.name}{self.brackets}"

    @property
    def brackets(self) -> str:
        """The unit in brackets, empty where there is none."""
        return f" [{self.unit.strip()}]" if self.unit else ""

    def value(self, x: float) -> str:
        """A value with its unit: two decimals of an angle, else four digits."""
        return f"{fixed(x, 2)}°" if self.unit == "°" else f"{x:.4g}{self.unit}"


SCATTER = "_sd"


def response_of(metric: str) -> Response:
    """`Response` of a run's metric, whose name ends in its unit (angle_of_repose_deg), under the
    name that people give it."""
    bare = without_unit(metric)
    own = bare.removesuffix(SCATTER)
    name = WORDS["metric"].get(own, label(without_unit(own)))
    return Response(f"scatter of the {name}" if own != bare else name, behind(unit_of(metric)))


ANGLE = response_of("angle_of_repose_deg")


BLUE, ORANGE, GREY, GREEN = "#2f6db5", "#d1711f", "#8a8f98", "#2e8b57"


@contextmanager
def styled() -> Iterator[Any]:
    """Draw in the style of all figures, by `matplotlib.pyplot`, which is given."""
    import matplotlib
    from matplotlib import pyplot as plt

    matplotlib.use("Agg")
    with plt.style.context("calibration.figures"):
        yield plt


def subplots(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (5.4, 3.8), **more: Any
) -> tuple[Drawing, Any]:
    """`matplotlib.pyplot.subplots` in the style of all figures; size: inches."""
    with styled() as plt:
        return plt.subplots(rows, columns, figsize=size, layout="constrained", **more)


def panels(
    items: Iterable[Any], size: tuple[float, float], draw: Callable[[Any, Any], None], **axes: Any
) -> Drawing:
    """Figure with a panel for each item, which draw(its axes, item) fills, two a row so that they
    read on a narrow page; size: inches of one; axes: as `add_subplot` takes them."""
    items = list(items)
    columns = min(len(items), 2)
    rows = -(-len(items) // columns)
    whole = size[0] * columns, size[1] * rows
    with styled() as plt:
        figure = plt.figure(figsize=whole, layout="constrained")
        for n, item in enumerate(items, start=1):
            draw(figure.add_subplot(rows, columns, n, **axes), item)
    return figure


def save(figure: Drawing, path: str | Path) -> None:
    """Write a figure to `path` (.svg or .png) and close it."""
    kind = str(path).rpartition(".")[2]
    how: dict[str, Any] = {"format": kind, "metadata": {"Date": None} if kind == "svg" else None}
    with styled() as plt:
        replace_file(path, lambda stream: figure.savefig(stream, dpi=150, **how))
        plt.close(figure)


def plane(
    region: Sequence[Factor], i: int, j: int, at: np.ndarray | None = None, resolution: int = 61
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A square grid over factors i and j: natural levels of i and of j (m, m), and the coded levels
    (m m, factors) of its points. The other factors are at the coded levels `at` (factors,), the
    centre unless given."""
    line = np.linspace(-1.0, 1.0, resolution)
    a, b = np.meshgrid(line, line)
    levels = np.tile(np.zeros(len(region)) if at is None else at, (a.size, 1))
    levels[:, i], levels[:, j] = a.ravel(), b.ravel()
    return region[i].natural(a), region[j].natural(b), levels


def label_3d(ax: Axes3D, x: str, y: str, z: str) -> None:
    """Label the axes of a small three-dimensional panel, which else run into each other."""
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.set_zlabel(z, fontsize=8)
    ax.tick_params(labelsize=7)
    ax.locator_params(nbins=4)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.set_box_aspect(None, zoom=0.85)
