"""The tables of data/paper, and the two samples of angles that the tests compare."""

import pandas as pd

from facts import ROOT
from paper.audit.paper import Paper

FOLDER = ROOT / "data" / "paper"


def paper_table(name):
    """The table of this name, without its ending."""
    return pd.read_csv(FOLDER / f"{name}.csv", comment="#")


def measured_angles():
    """The measured angles of repose [deg], (5 groups, 5 readings)."""
    return Paper(FOLDER).angles()["angle_deg"].to_numpy().reshape(5, 5)


def simulated_angles():
    """The paper's simulated angles of repose [deg], (5 groups, 5 replicates)."""
    table = paper_table("table13_validation")
    return table.pivot(index="group", columns="replicate", values="angle_deg").to_numpy()
