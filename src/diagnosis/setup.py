"""What the stages of a diagnosis share, made once of a study and the settings of the diagnosis."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from calibration.chain.study import Study
from calibration.files import read_json
from calibration.intake.measurements import Measurement
from calibration.runs.simulated import simulate, untested
from calibration.study.factors import Factor, read_factors
from diagnosis.catalogue import Mechanism
from diagnosis.derived import completed
from diagnosis.emulator import as_tests, train, train_failures
from diagnosis.lever_laws import lever_laws, with_laws
from diagnosis.measurements import Measured, alone, read_all
from diagnosis.model import Emulated
from diagnosis.rig import Rig
from diagnosis.settings import Settings, catalogue_of, check_levers, parameters_of, widened


class Setup:
    """A study's diagnosis before anything has been found: its table of measurements, checked, and
    how their conditions are simulated.

    study: a `calibration.chain.study.Study`, of which configuration and factors are used; settings:
    `diagnosis.settings.Settings`.
    """

    def __init__(self, study: Study, settings: Settings) -> None:
        self.config, self._given = study.config, settings

    @cached_property
    def table(self) -> Measured:
        """`Measured` of the study. Raises ConfigError for conditions that no emulator covers or
        that cannot be run."""
        table, path = self._read, self.config.measurements
        rows = table.fitted + table.held_out
        if not alone(m.experiment for m in table.fitted):
            check_levers(self._complete, rows, path)
        self._bare(self._complete).check(rows)
        return table

    @cached_property
    def _read(self):
        return read_all(self.config.measurements)

    @cached_property
    def _complete(self):
        """The settings, what they do not say of an experiment derived from the study."""
        table = self._read
        rows = table.fitted + table.held_out + table.outcomes
        return completed(self._given, self.config, self.factors, rows, self.config.measurements)

    @cached_property
    def settings(self) -> Settings:
        """The same, the ranges of the levers as wide as the table is."""
        table = self.table
        return widened(self._complete, table.fitted + table.held_out + table.outcomes)

    @property
    def measurements(self) -> list[Measurement]:
        """Return what is calibrated on."""
        return self.table.fitted

    @property
    def tested(self) -> list[Measurement]:
        """The same and the tests that ended without a value."""
        return self.table.fitted + self.table.outcomes

    @cached_property
    def kinds(self) -> list[str]:
        """The experiments among the measurements."""
        return list(dict.fromkeys(m.experiment for m in self.measurements))

    @property
    def of_contacts(self) -> bool:
        """Return whether single contacts are integrated, and nothing is emulated."""
        return alone(self.kinds)

    @property
    def emulated_kinds(self) -> list[str]:
        """The experiments that need emulators."""
        return [] if self.of_contacts else self.kinds

    @cached_property
    def catalogue(self) -> dict[str, Mechanism]:
        """{name: Mechanism}."""
        return catalogue_of(self.settings, self.kinds)

    @cached_property
    def rig(self) -> Rig:
        """`Rig` with the factors that are calibrated on the measurements."""
        known = parameters_of(self.settings, self.config.factors, self.kinds)
        return self._bare(self.settings).of(known)

    def _bare(self, settings):
        return Rig(settings, self.config.own_run | {"experiment": self.config.experiment})

    @cached_property
    def factors(self) -> list[Factor]:
        """All factors of the study."""
        return read_factors(self.config.factors)

    def emulated(
        self, designs: Sequence[str | Path], plans: Sequence[str | Path]
    ) -> tuple[Emulated, list[dict[str, Any]]]:
        """`Emulated` of emulators that the finished runs of all designs so far train, and a table
        of their errors."""
        rows = [row for file in designs for row in read_json(file)]
        specs = {name: spec for file in plans for name, spec in read_json(file).items()}
        settings, factors = self.settings, self.rig.factors
        metrics = as_tests(settings, specs, simulate(specs))
        emulators, errors = train(rows, metrics, settings, factors)
        faults = untested(name for name, found in metrics.items() if found is None)
        failures = train_failures(rows, metrics, settings, factors, faults)
        emulators = with_laws(emulators, settings, factors, self.lever_laws)
        failures = with_laws(failures, settings, factors, self.lever_laws)
        known = self.catalogue | self.lever_laws
        return Emulated(emulators, settings, factors, known, failures), errors

    @cached_property
    def lever_laws(self) -> dict[str, Mechanism]:
        """{name: Mechanism} of the free laws that are tried on bulk tests."""
        return lever_laws(self.settings, self.rig.factors, self.measurements)
