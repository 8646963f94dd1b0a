"""Tables of drops from what was read: `python data/literature/derive.py` writes those of `TABLES`.

From times between impacts: a flight of duration T between two impacts reaches g T^2 / 8; quadratic
drag changes that in second order only, since it shortens the rise by what it adds to the fall. Each
flight is a drop and the next one its rebound. Every flight is used once, so that the settings are
independent.

From heights read against a scale: replicates that agree to the last digit say no more than the
scale does, so the error of their mean is at least that of rounding, resolution / sqrt(12).
"""

from math import sqrt
from pathlib import Path

import pandas as pd

GRAVITY = 9.81
FOLDER = Path(__file__).parent
PAIRS = ((1, 2), (3, 4), (5, 6), (7, 8))


def flights(name):
    """Rows of drops from `{name}_intervals.csv`."""
    table = pd.read_csv(FOLDER / f"{name}_intervals.csv", comment="#")
    table, rows = table.set_index(["start_height_cm", "flight"]), []
    for start in table.index.unique("start_height_cm"):
        for first, second in PAIRS:
            fall, rise = (table.loc[(start, k)].to_numpy() for k in (first, second))
            drop = 1e3 * GRAVITY * (fall**2).mean() / 8.0
            ratio = (rise / fall) ** 2
            note = f"flights {first} and {second} of throws from {start} cm"
            rows.append(_row(drop, ratio.mean() * drop, ratio.std(ddof=1) * drop, len(ratio), note))
    return pd.DataFrame(rows)


def heights(name, resolution_mm):
    """Rows of drops from `{name}_heights.csv`, read to a resolution [mm]."""
    table, rows = pd.read_csv(FOLDER / f"{name}_heights.csv", comment="#"), []
    for line in table.set_index("drop_height_cm").itertuples():
        values = 10.0 * pd.Series(line[1:])
        n = len(values)
        sd = max(values.std(ddof=1), resolution_mm * sqrt(n / 12.0))
        rows.append(_row(10.0 * line[0], values.mean(), sd, n, f"{n} drops from {line[0]} cm"))
    return pd.DataFrame(rows)


def _row(drop, value, sd, n, note):
    return {
        "experiment": "drop",
        "quantity": "rebound_height",
        "value": round(value, 3),
        "unit": "mm",
        "sd": round(sd, 3),
        "n": n,
        "drop_height_mm": round(drop, 3),
        "note": note,
    }


def two_instruments(name, resolution_mm):
    """Rows of both readings of one ball, the instrument beside them."""
    parts = {"sound": flights(name), "video": heights(name, resolution_mm)}
    return pd.concat([t.assign(instrument=k) for k, t in parts.items()])


TABLES = {
    "table_tennis_ball": lambda: flights("table_tennis_ball"),
    "rubber_ball_flights": lambda: flights("rubber_ball"),
    "rubber_ball_two_instruments": lambda: two_instruments("rubber_ball", 1.0),
    "bouncy_ball": lambda: heights("bouncy_ball", 10.0),
}


if __name__ == "__main__":
    for name, make in TABLES.items():
        text = "# Made by derive.py from the readings beside it; README.md names the source.\n"
        (FOLDER / f"{name}.csv").write_text(text + make().to_csv(index=False))
