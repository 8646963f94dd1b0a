"""How the conditions of a study are simulated."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from calibration import engines
from calibration.errors import ConfigError
from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, POURED, Condition
from calibration.study.config import overlay
from calibration.study.config.specs import with_levels
from dem.errors import DemError, SpecError
from dem.spec import parse_spec
from diagnosis.catalogue import Mechanism
from diagnosis.measurements import CONTACTS
from diagnosis.settings import SIMULATED, Settings

TRIED = 0.5, 0.0, 1.0
"""Coded strengths at which an engine is asked whether it can have a mechanism. A rig that is too
small for the strongest is refused run by run; another code's law may end within the range."""


@dataclass(frozen=True)
class Rig:
    """What turns a `Condition` into a run spec: the settings of the diagnosis, laid over the run
    spec that was calibrated (`base`), and the factors that are calibrated on any experiment."""

    settings: Settings
    base: dict
    factors: tuple = ()

    def spec(
        self, condition: Condition, seed: int, values: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        """Run spec (a mapping) of a condition: calibration's spec, experiment's, levers, and factor
        values {name: value}.

        Of the values only those of the experiment's own parameters count: its emulators know no
        others.
        """
        experiment, levers = condition
        own = self.settings.experiments[experiment]
        levers = own.held | levers
        # the experiment that was calibrated on stands in the calibration's own rig
        shared = ["materials", "contacts", "law_parameters"]
        shared += ["geometry"] if experiment == self.base.get("experiment") else []
        shared += ["engine"] if experiment not in CONTACTS else []  # our own integrates those
        spec = overlay({k: v for k, v in self.base.items() if k in shared}, own.run)  # type: ignore[arg-type]  # `setup` fills it in
        spec["laws"] = dict(self.base.get("laws", {}))
        spec |= {"experiment": experiment, "seed": int(seed)}
        reference = spec["particles"].get("diameter_mm")
        for name, value in levers.items():
            if name in SIMULATED:
                section, key = cast(tuple[str, str], LEVERS[name].place)  # as SIMULATED says
                spec.setdefault(section, {})[key] = round(value) if key == "count" else value
        if experiment in POURED and "particle_count" not in levers:
            ratio = reference / spec["particles"]["diameter_mm"]
            spec["particles"]["count"] = max(round(spec["particles"]["count"] * ratio**3), 50)
        given, known = values or {}, cast(list[str], own.parameters)  # `setup` fills it in
        used = (f for f in self.factors if f.name in given and f.key in known)
        return with_levels(
            spec, {f.key: round(_possible(f.key, float(given[f.name])), 9) for f in used}
        )

    def check(self, measurements: Iterable[Measurement]) -> None:
        """Raise ConfigError where an experiment's run spec cannot be run at a measured
        condition."""
        for m in measurements:
            try:
                engines.check(parse_spec(self.spec(m.condition, 0)))
            except DemError as error:
                key = f"experiments.{m.experiment}.run"
                line = "" if m.line is None else f"line {m.line}, "
                raise ConfigError(f"{line}{m.label}: {error}", key=key) from None

    def refuses(self, experiment: str, mechanism: Mechanism) -> bool:
        """Return whether the engine cannot have a mechanism in an experiment."""
        own = self.settings.experiments[experiment]
        ranges = cast(dict[str, list[float]], own.levers)  # `setup` fills it in
        levers = {name: low for name, (low, _) in ranges.items()}
        spec = self.spec(Condition(experiment, levers), 0)
        middle, *ends = (mechanism.apply(spec, mechanism.strength.natural(c)) for c in TRIED)
        return _refused(middle, DemError) or any(_refused(s, engines.EngineError) for s in ends)


def _refused(spec, kind):
    """Return whether a spec (a mapping) is refused with an error of that kind."""
    try:
        engines.check(parse_spec(spec))
    except DemError as error:
        return isinstance(error, kind)
    return False


def _possible(key, value):
    """A level of a coefficient that can be: emulators reach a little beyond a factor's range, which
    may end at nothing, or at a restitution of 1."""
    if not key.startswith("contacts."):
        return value
    return min(max(value, 0.0), 1.0 if key.endswith(".restitution") else math.inf)


def combine(
    settings: Settings, mechanisms: Iterable[Mechanism], conditions: Iterable[tuple[str, dict]]
) -> bool:
    """Return whether the engine can have all of the mechanisms at once in the experiments of
    conditions [(experiment, levers)]: no two of them are in the same slot, and the engine takes the
    spec. Those of the reading go with any."""
    rig = Rig(settings, {})
    for experiment, levers in dict(conditions).items():
        plain = spec = rig.spec(Condition(experiment, levers), 0)
        taken: set[str] = set()
        for m in (m for m in mechanisms if m.observe is None and experiment in m.experiments):
            strength = m.strength.natural(0.5)
            slots = {s for s, _ in m.apply(plain, strength)["laws"].items() - plain["laws"].items()}
            if slots & taken:
                return False
            taken |= slots
            spec = m.apply(spec, strength)
        try:
            parse_spec(spec)
        except SpecError:
            return False
    return True
