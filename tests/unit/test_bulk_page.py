"""What the page of the bulk processes says is computed from the kept runs and speeds."""

import pandas as pd
import pytest

from benchmarks.bulk.codes import CODES
from paper.release import bulk_processes
from paper.release.bulk_processes import RUNS, SPEEDS


@pytest.fixture
def kept(tmp_path):
    """A sphere that falls alike in two codes, but for half a radius of a grain on the way down and
    two at the end, with four more starts of this engine that end a hundredth of a millimetre apart,
    and a case whose speed is known in one more."""
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
    codes = [*bulk_processes.STARTS["micrometres"], "liggghts"]
    runs = [
        {"case": bulk_processes.FALL, "code": code, "processor_s": 1200.4, **about}
        for code in codes
    ]
    pd.DataFrame(runs).to_csv(folder / RUNS, index=False)
    for number, code in enumerate(codes):
        fall = pd.DataFrame({"time_s": [0.001 * k for k in range(41)]})
        fall["height_m"] = 0.06 - fall["time_s"].where(fall["time_s"] < 0.02, 0.02)
        if code == "liggghts":
            fall.loc[7, "height_m"] += 0.5 * bulk_processes.GRAIN
            fall.loc[40, "height_m"] += 2.0 * bulk_processes.GRAIN
        else:
            fall.loc[40, "height_m"] += 1e-5 * number
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
    assert found["fallen"] == ["this engine", "LIGGGHTS"]
    assert found["heights"][0] == ["20", "40.00", "40.00", "40.00 to 40.00"]
    assert found["heights"][-1] == ["40", "40.00", "42.00", "40.00 to 40.04"]


def test_a_fall_is_judged_by_the_starts_scatter(kept):
    """Five starts end at 0 to 4 hundredths of a millimetre: mean 2, standard deviation the root of
    2.5, so that one more is expected within the root of 3 of two."""
    path = kept / bulk_processes.FOLDER / f"{bulk_processes.FALL}.liggghts.csv"
    assert bulk_processes.values(kept)["chance"]["LIGGGHTS"]["micrometres"] < 1e-6
    fall = pd.read_csv(path)
    fall.loc[40, "height_m"] = 0.04 + 1e-5 * (2.0 + 3.0**0.5 * 2.776445)  # t of 5 % on 4
    fall.to_csv(path, index=False)
    found = bulk_processes.values(kept)
    assert found["starts"] == {"micrometres": 5}
    assert found["chance"]["LIGGGHTS"] == {"micrometres": pytest.approx(0.05, abs=1e-5)}
    runs = kept / bulk_processes.FOLDER / RUNS
    table = pd.read_csv(runs)
    table[table["code"].isin(["dem", "liggghts"])].to_csv(runs, index=False)
    assert bulk_processes.values(kept)["chance"]["LIGGGHTS"] == {}


def test_the_page_reads_what_the_codes_are_called():
    told = {code for own in bulk_processes.STARTS.values() for code in own}
    assert told | set(bulk_processes.NAMES) == set(CODES) - {"dem-double"}
