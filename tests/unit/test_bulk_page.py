"""What the page of the bulk processes says is computed from the kept runs and speeds."""

import pandas as pd
import pytest

from facts import tells
from frozen import FROZEN
from paper.release import pages, values


@pytest.fixture
def kept(tmp_path):
    """A sphere that falls alike in two codes, but for half a radius of a grain on the way down and
    two at the end, with four more starts of this engine that end a hundredth of a millimetre apart,
    and a case whose speed is known in one more."""
    folder = tmp_path / "bulk-processes"
    folder.mkdir()
    (tmp_path / "salt").symlink_to(FROZEN / "salt")
    about = {"date": "2026-11-27", "engine": "abc", "machine": "one"}
    speeds = [("a", "dem", 2e7), ("a", "liggghts", 4e6), ("b", "dem", 1e7), ("b", "yade", 1e6)]
    pd.DataFrame(
        [
            {"case": case, "code": code, "grains": 1000, "particle_steps_per_s": rate, **about}
            for case, code, rate in speeds
        ]
    ).to_csv(folder / "speeds.csv", index=False)
    codes = [*values.STARTS["micrometres"], "liggghts"]
    runs = [{"case": values.FALL, "code": code, "processor_s": 1200.4, **about} for code in codes]
    pd.DataFrame(runs).to_csv(folder / "runs.csv", index=False)
    for number, code in enumerate(codes):
        fall = pd.DataFrame({"time_s": [0.001 * k for k in range(41)]})
        fall["height_m"] = 0.06 - fall["time_s"].where(fall["time_s"] < 0.02, 0.02)
        if code == "liggghts":
            fall.loc[7, "height_m"] += 0.5 * values.GRAIN
            fall.loc[40, "height_m"] += 2.0 * values.GRAIN
        else:
            fall.loc[40, "height_m"] += 1e-5 * number
        fall.to_csv(folder / f"{values.FALL}.{code}.csv", index=False)
    return folder


def said(kept):
    """The table's rows and the text below it."""
    text = pages.filled("bulk_processes", kept.parent)
    return [line for line in text.splitlines() if line.startswith("|")][2:], " ".join(text.split())


def test_speeds_stand_beside_this_engine_s(kept):
    assert said(kept)[0] == [
        "| a | 1,000 | 20 | 4 (1/5) | not run | not run |",
        "| b | 1,000 | 10 | not run | not run | 1 (1/10) |",
    ]


def test_falls_are_compared_where_both_were_looked_at(kept):
    assert tells(said(kept)[1], "20 ms", "0.50 radii of a grain in LIGGGHTS")
    assert tells(said(kept)[1], "Afterwards", "2.00 in LIGGGHTS")
    found = values.falls(kept)
    assert values.apart(found["dem"], found["liggghts"]) == pytest.approx((0.5, 2.0))


def test_a_fall_is_judged_by_the_starts_scatter(kept):
    """Five starts end at 0 to 4 hundredths of a millimetre: mean 2, standard deviation the root of
    2.5, so that one more is expected within the root of 3 of two."""
    path = kept / f"{values.FALL}.liggghts.csv"
    found = values.falls(kept)
    assert values.chances(found, found["liggghts"])[0] < 1e-6
    assert tells(said(kept)[1], "not chance")
    fall = pd.read_csv(path)
    fall.loc[40, "height_m"] = 0.04 + 1e-5 * (2.0 + 3.0**0.5 * 2.776445)  # t of 5 % on 4
    fall.to_csv(path, index=False)
    found = values.falls(kept)
    assert values.chances(found, found["liggghts"]) == [pytest.approx(0.05, abs=1e-5)]
    few = {code: found[code] for code in ("dem", "liggghts")}
    assert values.chances(few, found["liggghts"]) == []
