"""Rebound heights from the times between impacts: `python data/literature/derive.py` writes
table_tennis_ball.csv.

A flight of duration T between two impacts reaches g T^2 / 8; quadratic drag changes that in second
order only, since it shortens the rise by what it adds to the fall. Each flight is a drop and the
next one its rebound. Every flight is used once, so that the settings are independent.
"""

from pathlib import Path

import pandas as pd

GRAVITY = 9.81
FOLDER = Path(__file__).parent
PAIRS = ((1, 2), (3, 4), (5, 6), (7, 8))


def measurements(path=FOLDER / "table_tennis_ball_intervals.csv"):
    """Rows of the diagnosis' table of measurements."""
    table = pd.read_csv(path, comment="#").set_index(["start_height_cm", "flight"])
    rows = []
    for start in table.index.unique("start_height_cm"):
        for first, second in PAIRS:
            fall, rise = (table.loc[(start, k)].to_numpy() for k in (first, second))
            drop = 1e3 * GRAVITY * (fall**2).mean() / 8.0
            ratio = (rise / fall) ** 2
            rows.append(
                {
                    "experiment": "drop",
                    "quantity": "rebound_height",
                    "value": round(ratio.mean() * drop, 3),
                    "unit": "mm",
                    "sd": round(ratio.std(ddof=1) * drop, 3),
                    "n": len(ratio),
                    "drop_height_mm": round(drop, 3),
                    "note": f"flights {first} and {second} of throws from {start} cm",
                }
            )
    return pd.DataFrame(rows)


if __name__ == "__main__":
    text = "# Made by derive.py from table_tennis_ball_intervals.csv.\n"
    (FOLDER / "table_tennis_ball.csv").write_text(text + measurements().to_csv(index=False))
