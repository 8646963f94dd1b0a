"""A diagnosis of the drop test, its emulators taught by the real engine (cached for the session)."""

from pathlib import Path

import pytest
import yaml

from calibration.discrepancy.catalogue import load_catalogue
from calibration.discrepancy.design import plan
from calibration.discrepancy.emulator import teach
from calibration.discrepancy.model import Emulated
from calibration.discrepancy.runs import simulate
from calibration.discrepancy.settings import parameters_of, read_settings

FACTORS = "config/factors.tsv"


class Bench:
    """Emulators of the drop test and what is needed to hide an effect in one."""

    factors_file = FACTORS

    def __init__(self, root):
        self.root = root
        self.base = yaml.safe_load(Path("config/config.yaml").read_text())["run"]
        self.settings = read_settings("config/diagnosis.yaml", {"runs_per_input": 5})
        self.catalogue = load_catalogue(without=["under_resolved_contact", "wall_adhesion"])
        self.factors = parameters_of(self.settings, FACTORS, ["drop"])
        rows, specs = plan(self.settings, self.base, self.factors, self.catalogue, ["drop"])
        metrics = simulate(specs, root)
        self.emulators, self.errors = teach(rows, metrics, self.settings, self.factors)

    def emulated(self, without=()):
        """The diagnosis with mechanisms removed from its catalogue."""
        known = {k: v for k, v in self.catalogue.items() if k not in without}
        return Emulated(self.emulators, self.settings, self.factors, known)


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    """`Bench` of this session."""
    return Bench(tmp_path_factory.mktemp("runs"))
