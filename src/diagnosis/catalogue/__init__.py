"""The catalogue of mechanisms: the files of this folder, and of a study's own
(`diagnosis.catalogue`), each of which defines `MECHANISM`.

A mechanism of the engine has `apply(spec, strength)`, which returns a run spec with its law
switched on. A mechanism of the measurement has `observe(value, condition, strength)` instead: what
would have been read in place of the true value (arrays or floats; condition is the mapping of
levers). It changes no run.
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

    @property
    def weakest(self) -> float:
        """Coded strength at which it is weakest."""
        return self.coded(self.low if self.off is None else self.off)


def _unchanged(spec, strength):
    return spec


@dataclass(frozen=True)
class Mechanism:
    """One thing that a model may be missing.

    law: (slot, state) of the free law (`diagnosis.laws`) that it is a case of; changes: key of the
    coefficient and the lever along which it changes, of a free law of bulk tests.
    """

    name: str
    description: str
    source: str
    experiments: tuple
    strength: Strength
    apply: Callable = _unchanged
    observe: Callable | None = None
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


def setting(slot: str, law: str, key: str, **fixed: float) -> Callable[..., dict[str, Any]]:
    """`apply` of a law of the engine whose parameter `key` is the strength."""
    return lambda spec, strength: set_law(spec, slot, law, **{key: strength}, **fixed)


def coarse(spec: Mapping[str, Any]) -> float:
    """Factor by which the grains of a run spec (a mapping) are coarser than those that they stand
    for.

    A force that is proportional to the radius is multiplied by it. Force over area is then that of
    the finer grains, and so is the ratio of cohesion to the weight of a heap in the same rig.
    """
    return spec.get("particles", {}).get("scale_factor", 1.0)


def load_catalogue(folder: str | Path | None = None) -> dict[str, Mechanism]:
    """{name: Mechanism} of every module beside this one and of every file in `folder`, each with
    the experiments that name it beside those that it names itself.

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
    for name, m in found.items():
        naming = [kind for kind, e in experiments().items() if name in e.mechanisms]
        found[name] = replace(m, experiments=tuple(dict.fromkeys([*m.experiments, *naming])))
    return found


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
