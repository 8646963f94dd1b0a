"""The catalogue of mechanisms: each module beside this one defines `MECHANISM`; nothing else lists
them.

A study may add a folder of its own (`diagnosis.catalogue`), each file of which does the same.

A mechanism of the engine has `apply(spec, strength)`, which returns a run spec with its law
switched on. A mechanism of the measurement also has `observe(value, condition, strength)`: what
would have been read in place of the true value (arrays or floats; condition is the mapping of
levers). Its `apply` uses the engine's own model of the instrument and makes test data.
"""

import importlib
import importlib.util
import math
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import Any

from calibration.errors import ConfigError
from dem.contact.catalogue import LAWS
from dem.experiments import experiments
from dem.spec import keys_of


@dataclass(frozen=True)
class Strength:
    """The one number that says how strong a mechanism is, with its range in `unit`.

    `off` is where it is weakest, `low` unless given.
    """

    name: str
    unit: str
    low: float
    high: float
    _: KW_ONLY
    log: bool = False
    off: float | None = None

    def natural(self, coded: Any) -> Any:
        """Strength in its unit from a coded one in [0, 1]."""
        if self.log:
            return self.low * (self.high / self.low) ** coded
        return self.low + coded * (self.high - self.low)

    def coded(self, natural: float) -> float:
        """Coded strength in [0, 1] from one in its unit."""
        if self.log:
            return math.log(natural / self.low) / math.log(self.high / self.low)
        return (natural - self.low) / (self.high - self.low)

    def slope(self, coded: Any) -> Any:
        """Derivative of `natural`."""
        if self.log:
            return self.natural(coded) * math.log(self.high / self.low)
        return self.high - self.low + 0.0 * coded

    @property
    def weakest(self) -> float:
        """Coded strength at which it is weakest."""
        return self.coded(self.low if self.off is None else self.off)


@dataclass(frozen=True)
class Mechanism:
    """One thing that a model may be missing.

    multiplies: a lever, if the mechanism is the base model with that lever times the strength and
    nothing else. law: (slot, state) of the free law (`diagnosis.laws`) that it is a case of.
    changes: key of the coefficient and the lever along which it changes, of a free law of bulk
    tests.
    """

    name: str
    description: str
    source: str
    experiments: tuple
    levers: tuple
    strength: Strength
    apply: Callable
    observe: Callable | None = None
    multiplies: str | None = None
    law: tuple | None = None
    changes: tuple | None = None


def set_law(spec: dict[str, Any], slot: str, law: str, **parameters: float) -> dict[str, Any]:
    """Run spec (a mapping) with one law chosen and its parameters set, without those of the law
    that it replaces; the given one is left as it was."""
    before = LAWS[slot].get(spec.get("laws", {}).get(slot))
    gone = keys_of(before) - keys_of(LAWS[slot][law]) if before else ()
    kept = {k: v for k, v in spec.get("law_parameters", {}).items() if k not in gone}
    return spec | {
        "laws": spec.get("laws", {}) | {slot: law},
        "law_parameters": kept | parameters,
    }


def set_part(spec: dict[str, Any], part: str, **values: Any) -> dict[str, Any]:
    """Run spec (a mapping) with values of one of its parts set; the given one is left as it was."""
    return spec | {part: spec.get(part, {}) | values}


def coarse(spec: Mapping[str, Any]) -> float:
    """Factor by which the grains of a run spec (a mapping) are coarser than those that they stand
    for.

    A force that is proportional to the radius is multiplied by it. Force over area is then that of
    the finer grains, and so is the ratio of cohesion to the weight of a heap in the same rig.
    """
    return spec.get("particles", {}).get("scale_factor", 1.0)


def load_catalogue(folder: str | Path | None = None) -> dict[str, Mechanism]:
    """{name: Mechanism} of every module beside this one and of every file in `folder`.

    Raises ConfigError for a folder that is not there and for a file that defines no new mechanism.
    """
    modules = [
        importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)
    ]
    found = {m.MECHANISM.name: m.MECHANISM for m in modules}
    if folder is not None and not Path(folder).is_dir():
        raise ConfigError("is no folder", path=folder, key="diagnosis.catalogue")
    for path in sorted(Path(folder).glob("[!_]*.py")) if folder is not None else ():
        mechanism = _mechanism_of(path)
        if mechanism.name in found:
            allowed = f"another than {', '.join(found)}"
            raise ConfigError(
                "is taken", path=path, key="name", value=mechanism.name, allowed=allowed
            )
        found[mechanism.name] = mechanism
    return {name: _where_it_shows(m) for name, m in found.items()}


def _where_it_shows(mechanism):
    """The mechanism with the experiments that name it beside those that it names itself."""
    more = [
        name
        for name, e in experiments().items()
        if mechanism.name in e.mechanisms and name not in mechanism.experiments
    ]
    return replace(mechanism, experiments=(*mechanism.experiments, *more)) if more else mechanism


def _mechanism_of(path):
    spec = importlib.util.spec_from_file_location(f"mechanism_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the file is the user's
        raise ConfigError(f"cannot be loaded ({error})", path=path) from error
    mechanism = getattr(module, "MECHANISM", None)
    if not isinstance(mechanism, Mechanism):
        raise ConfigError("defines no mechanism", path=path, allowed="MECHANISM = Mechanism(...)")
    return mechanism
