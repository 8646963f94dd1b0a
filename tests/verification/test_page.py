"""The page says what was recorded, and says so where nothing was."""

import page
import page_figures
import pandas as pd

from calibration.stages.numerics import compare_variants
from facts import rows_in
from frozen import FROZEN


def test_a_run_of_the_numerics_without_a_value_is_told(tmp_path, monkeypatch):
    angles = {"a": 30.0, "b": 31.0, "c": 30.5, "d": 33.0, "e": None, "f": 33.2}
    angles |= {"g": None, "h": 32.0, "i": None}
    monkeypatch.setattr("calibration.stages.numerics.read_values", lambda ids, *_: ids.map(angles))
    monkeypatch.setattr(page_figures, "FOLDER", tmp_path)
    design = pd.DataFrame({"run_id": list(angles), "point": "optimum"})
    design["variant"] = ["default"] * 3 + ["half the step"] * 3 + ["a tenth of the step"] * 3
    design["against"] = [""] * 3 + ["default"] * 6
    table = compare_variants(design, "angle")
    table.round(3).to_csv(tmp_path / "numerics.csv", index=False)
    text = "\n".join(page.numerics_section(tmp_path / "numerics.csv"))
    rows, tenth = rows_in(text), "a tenth of the step"
    told = ["default", "optimum"]
    assert rows["half the step"][:6] == [*told, "2 of 3", "33.10", "0.14", "+2.60"]
    assert rows[tenth] == [*told, "1 of 3", "32.00", "", "", "", ""]


def test_the_correction_for_softened_grains_is_welch_s_interval():
    table = pd.read_csv(FROZEN / "salt" / "numerics" / "numerics.csv")
    one = table[table["point"] == "high"]  # of one point alone it is Welch's own interval
    row = one[one["variant"] == page.STIFFER].iloc[0]
    of_one = f"{row.low:+.2f} to {row.high:+.2f})"
    assert page.softening(one).count(of_one) == 2
