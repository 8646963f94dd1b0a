"""What the page of the bulk processes says is computed from the kept runs and speeds."""

import pandas as pd
import pytest

from dem.benchmark.bulk_processes.__main__ import RUNS, SPEEDS
from paper.release import bulk_processes


@pytest.fixture
def kept(tmp_path):
    """A sphere that falls alike in two codes, but for half a radius of a grain on the way down and
    two after it, and a case whose speed is known in one more."""
    folder = tmp_path / bulk_processes.FOLDER
    folder.mkdir()
    about = {"date": "2026-11-27", "engine": "abc", "machine": "one"}
    speeds = [("a", "dem", 2e7), ("a", "liggghts", 4e6), ("b", "dem", 1e7), ("b", "yade", 1e6)]
    pd.DataFrame(
        [
            {"case": case, "code": code, "grains": 1000, "particle_steps_per_s": rate, **about}
            for case, code, rate in speeds
        ]
    ).to_csv(folder / SPEEDS, index=False)
    codes = ["dem", "liggghts"]
    runs = [
        {"case": bulk_processes.FALL, "code": code, "processor_s": 1200.4, **about}
        for code in codes
    ]
    pd.DataFrame(runs).to_csv(folder / RUNS, index=False)
    for code, looks in (("dem", 41), ("liggghts", 41)):
        fall = pd.DataFrame({"time_s": [0.001 * k for k in range(looks)]})
        fall["height_m"] = 0.06 - fall["time_s"].where(fall["time_s"] < 0.02, 0.02)
        if code == "liggghts":
            fall.loc[7, "height_m"] += 0.5 * bulk_processes.GRAIN
            fall.loc[25, "height_m"] += 2.0 * bulk_processes.GRAIN
        fall.to_csv(folder / f"{bulk_processes.FALL}.{code}.csv", index=False)
    return tmp_path


def test_speeds_stand_beside_this_engine_s(kept):
    first, second = bulk_processes.values(kept)["speeds"]
    assert first["cells"] == ["20", "4 (1/5)", "not run", "not run"]
    assert second["cells"] == ["10", "not run", "not run", "1 (1/10)"]


def test_falls_are_compared_where_both_were_looked_at(kept):
    found = bulk_processes.values(kept)
    assert found["apart"] == {"LIGGGHTS": ("0.50", "2.00")}
    assert found["lowest_ms"] == "20"
    assert found["spent"] == {"this engine": "1,200 s", "LIGGGHTS": "1,200 s"}
    assert found["heights"][0] == ["20", "40.00", "40.00"]
