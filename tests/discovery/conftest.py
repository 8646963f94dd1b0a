"""A laboratory for the drop test, its emulators trained by the real engine (cached for the
session)."""

from pathlib import Path

import pytest
import yaml
from laboratory import Laboratory

from benchmarks.rates import hidden
from calibration.runs.simulated import simulate
from diagnosis.catalogue import load_catalogue
from diagnosis.design import plan as plan_runs
from diagnosis.emulator import train
from diagnosis.model import Emulated
from diagnosis.rig import Rig
from diagnosis.settings import parameters_of, read_settings

FACTORS = "config/factors.tsv"
MECHANISMS = ("viscoelastic_restitution", "plastic_restitution", "air_drag", "apex_sampling")
SMALL = {
    "runs_per_input": 6,
    "experiments": {
        "drop": {
            "levers": {"particle_diameter_mm": [1.5, 4.0]},
            "runs_per_input": None,
            "mechanisms": [m for m in MECHANISMS if m != "apex_sampling"],
        },
        "tilt": None,
        "heap": None,
        "shear": None,
    },
}
"""Changes of the benchmark's settings: drops of larger grains, a tenth of a second each."""

PLAN = [
    (e, x | {"particle_diameter_mm": max(x["particle_diameter_mm"], 1.5)}) for e, x in hidden.DROPS
]


def laboratory(root, changes, mechanisms, plan=hidden.PLAN):
    """`Laboratory` of the benchmark's settings with changes and plan, and the errors of its
    emulators."""
    base = yaml.safe_load(Path("config/config.yaml").read_text())["run"]
    settings = read_settings("benchmarks/rates/settings.yaml", changes)
    catalogue = {n: m for n, m in load_catalogue().items() if n in mechanisms}
    kinds = list(settings.experiments)
    factors = parameters_of(settings, FACTORS, kinds)
    rows, specs = plan_runs(Rig(settings, base, factors), catalogue, kinds)
    emulators, errors = train(rows, simulate(specs, root), settings, factors)
    emulated = Emulated(emulators, settings, factors, catalogue)
    return Laboratory(emulated, Rig(settings, base, factors), 120, root, plan), errors


@pytest.fixture(scope="session")
def make_laboratory():
    """The function `laboratory`."""
    return laboratory


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """The laboratory and the table of its emulators' errors."""
    return laboratory(tmp_path_factory.mktemp("runs"), SMALL, MECHANISMS, PLAN)


@pytest.fixture(scope="session", name="laboratory")
def trained_laboratory(trained):
    """`Laboratory` of this session."""
    return trained[0]


@pytest.fixture(scope="session")
def drops():
    """Plan of the drop test."""
    return PLAN
