"""What LIGGGHTS gave: tables and the places of the grains in its last heaps, kept beside the input
decks."""

import numpy as np
import pandas as pd

from .peer import FOLDER

MICRON = 1e-6
DIGITS = "%.9g"


def read(name):
    """Recorded table `name`.csv."""
    return pd.read_csv(FOLDER / f"{name}.csv")


def write(name, rows, version):
    """Write rows (mappings, or one frame) as `name`.csv; every row names the engine."""
    pd.DataFrame(rows).assign(engine=version).to_csv(
        FOLDER / f"{name}.csv", index=False, float_format=DIGITS
    )


def add_heap(row, position, version):
    """Put one heap into heaps.csv, and the places (n, 3) [m] of its grains, to a micrometre, beside
    it."""
    case, seed = row["case"], row["seed"]
    path = FOLDER / "heaps.csv"
    old = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=["case", "seed"])
    others = old[(old["case"] != case) | (old["seed"] != seed)].drop(
        columns="engine", errors="ignore"
    )
    table = pd.concat([others, pd.DataFrame([row])]) if len(others) else pd.DataFrame([row])
    write("heaps", table.sort_values(["case", "seed"]), version)
    np.savez_compressed(
        _grains(case, seed), position_um=np.rint(position / MICRON).astype(np.int32)
    )


def read_grains(case, seed):
    """Places (n, 3) [m] of the grains of a recorded heap."""
    with np.load(_grains(case, seed)) as stored:
        return MICRON * stored["position_um"]


def _grains(case, seed):
    name = "_".join("".join(c if c.isalnum() else " " for c in case).split())
    return FOLDER / f"heap_{name}_{seed}.npz"


def contact_rows(name, force, torque):
    """Rows of contacts.csv: force [N] and torque [N m] on each grain."""
    columns = [*(f"f{a}_N" for a in "xyz"), *(f"t{a}_Nm" for a in "xyz")]
    return _rows(name, columns, force, torque)


def impact_rows(name, velocity, spin):
    """Rows of impacts.csv: velocity [m/s] and spin [rad/s] of each grain after the impact."""
    columns = [*(f"v{a}_m_s" for a in "xyz"), *(f"w{a}_rad_s" for a in "xyz")]
    return _rows(name, columns, velocity, spin)


def _rows(name, columns, first, second):
    table = pd.DataFrame(np.hstack([first, second]), columns=columns)
    table.insert(0, "case", name)
    return table


def of_case(table, name):
    """Two arrays (n, 3): the numbers of one case of contacts.csv or impacts.csv."""
    numbers = table.loc[table["case"] == name].select_dtypes("number").to_numpy(float)
    return numbers[:, :3], numbers[:, 3:6]
