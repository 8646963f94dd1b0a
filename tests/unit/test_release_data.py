"""A release: its pages say what its data say, and it makes what is not of the present engine."""

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from benchmarks import code_studies
from facts import tells
from frozen import FROZEN
from paper.release import __main__ as command
from paper.release import pages, values
from paper.release.pages import KEPT, PAGE, read_record
from paper_tables import paper_table


@pytest.fixture
def kept(repository, tmp_path):
    """The frozen runs as a folder of kept results; the rig as printed is the study's own, in which
    some funnels packed."""
    folder = tmp_path / "kept"
    shutil.copytree(FROZEN, folder)
    shutil.copytree(folder / "salt", folder / "salt-printed")
    shutil.copytree(KEPT / "salt-atlas", folder / "salt-atlas")
    (folder / "salt-diagnosis").mkdir()
    for name in ("verdict.json", "diagnosis.md"):
        shutil.copy(folder / "table-tennis-ball" / name, folder / "salt-diagnosis")
    table = pd.read_csv(folder / "rigs" / "runs.csv")
    printed = (table["generation_rate_per_s"] == 10000) & (table["injection_speed_m_s"] == 0.3)
    table.loc[printed.idxmax(), "hold_up"] = 3000
    table.to_csv(folder / "rigs" / "runs.csv", index=False)
    return folder


def said(kept):
    """What is written into the README below its table, in one line."""
    return " ".join(pages.filled("readme", kept).split())


def test_the_pages_show_the_release_s_data(repository):
    assert pages.filled("results", KEPT) == PAGE.read_text()
    for (page, begin, end), text in pages.pieces().items():
        assert page.read_text().split(begin)[1].split(end)[0].strip() == text


def test_the_first_screen_counts_the_verdicts_of_the_table(repository, kept):
    path = kept / "salt" / "reproduction" / "reproduction.csv"
    table = pd.read_csv(path, dtype={"paper": str}).set_index("id")
    effects = table.loc[[f"table07.{c}.effect" for c in values.FACTORS], "agreement"]
    n = pages.counted((effects == "different").sum())
    differ = [f"(Table {k})" for k in (6, 9, 10, 11)]
    assert tells(said(kept), f"differ from {n}", "seven effects", *differ)
    assert tells(said(kept), "sliding angles", "(Table 8)", "agree")
    # another engine's results: what is said follows
    table.loc["table9.whole", "agreement"] = "equivalent"
    table.loc["table07.G.effect", "agreement"] = "equivalent"
    table.loc["table07.E.effect", "this_project"] = "-25.0"
    table.loc["shear.slope", "agreement"] = "different"
    table.reset_index().to_csv(path, index=False)
    text = said(kept)
    assert tells(text, "differ from five", "(Table 6)", "(Table 10)", "(Table 11)")
    assert tells(text, "sliding angles", "(Table 8)", "rebounds", "(Table 9)", "agree")
    assert tells(text, "Restitution, salt", "rolling friction, salt")


def test_effects_and_funnels_are_those_of_the_tables():
    table = pd.read_csv(FROZEN / "salt" / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna()
    packed = runs["hold_up"] > 1250
    # the two kinds lie apart in what the funnel held
    held = runs["hold_up"]
    assert held[packed].min() - held[~packed].max() > 2 * held[~packed].std()
    found = values.funnels(FROZEN / "salt")
    assert (found["packed"], found["runs"]) == (packed.sum(), len(runs))
    steep, flat = (runs["angle_of_repose_deg"][k] for k in (packed, ~packed))
    error = np.hypot(stats.sem(steep), stats.sem(flat))
    assert found["steeper"] == f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°"
    slow = pd.read_csv(FROZEN / "salt-slow" / "screening" / "effects.csv").set_index("code")
    paper = paper_table("table06_plackett_burman")
    columns = np.column_stack([np.ones(len(paper)), paper[values.FACTORS]])
    slopes = np.linalg.lstsq(columns, paper["angle_deg"], rcond=None)[0][1:]
    off = slow["effect"][values.FACTORS] - 2.0 * slopes
    assert values.off_the_paper(slow) == pytest.approx(np.sqrt(np.mean(off**2)))


def test_a_release_makes_what_is_not_of_this_engine_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("results/a").mkdir(parents=True)
    Path("results/a/table.csv").write_text("x\n1\n")
    code = "import pathlib,sys; p = pathlib.Path('t'); n = p.exists(); p.touch(); sys.exit(not n)"
    parts = {
        "a": {"about": "first", "commands": ["python -c 1"], "copies": {"results/a": "a"}},
        "b": {"about": "fails at first", "commands": [shlex.join(["python", "-c", code])]},
    }
    monkeypatch.setattr(command, "PARTS", parts)
    monkeypatch.setattr(command, "write_pages", lambda: None)
    monkeypatch.setattr(command, "engine_fingerprint", lambda: "e" * 16)
    assert command.main([]) == 1
    assert "b: " in capsys.readouterr().err
    assert Path("results/reference/a/table.csv").is_file()
    assert set(read_record()) == {"a"}
    assert command.main(["-n"]) == 0
    said = capsys.readouterr().out
    assert "a: made" in said
    assert tells(said, "1 of 2")
    assert command.main([]) == 0
    assert read_record()["b"]["engine"] == "e" * 16
    assert command.main(["c"]) == 2
    assert tells(capsys.readouterr().err, "c", "no part", "a, b")


@pytest.mark.parametrize("off", [0.0, -3.0])
def test_another_code_s_heaps_are_compared_with_ours_at_their_points(
    repository, tmp_path, monkeypatch, off
):
    """Of a made-up code whose heaps are flatter by a known angle, and by none."""
    rng, n = np.random.default_rng(3), 12
    levels = rng.uniform(0.1, 0.5, (n, 3))
    levels[5] = levels[4]  # a replicate: both count as one point
    for stage, some in zip(code_studies.POINTS, np.split(np.arange(n), 2), strict=True):
        specs, angles = {}, []
        for k in some:
            rolling, friction, wall = levels[k]
            pairs = {
                "particle_particle": {"rolling_friction": rolling, "static_friction": friction}
            }
            pairs["particle_wall"] = {"static_friction": wall}
            specs[f"heap-{k}"] = {"seed": int(k), "contacts": pairs}
            angles.append(15.0 + 40.0 * rolling + off + 0.1 * rng.standard_normal())
        (tmp_path / "theirs" / stage).mkdir(parents=True)
        (tmp_path / "theirs" / stage / "plan.json").write_text(json.dumps(specs))
        runs = pd.DataFrame({"run_id": list(specs), "response": angles})
        runs.to_csv(tmp_path / "theirs" / stage / "runs.csv", index=False)
    (tmp_path / "theirs" / "validation").mkdir()
    (tmp_path / "theirs" / "validation" / "validation.json").write_text('{"simulated_sd": 0.1}')
    validated = {f"heap-v{k}": specs["heap-6"] | {"seed": k} for k in range(6)}
    (tmp_path / "theirs" / "validation" / "plan.json").write_text(json.dumps(validated))

    def ours(specs, root):
        keys = [s["contacts"]["particle_particle"]["rolling_friction"] for s in specs]
        found = 15.0 + 40.0 * np.array(keys) + 0.1 * rng.standard_normal(len(keys))
        found[1] = np.nan  # of ours one gives no value
        return found

    monkeypatch.setattr(code_studies, "ours_at", ours)
    found = code_studies.compared(tmp_path / "theirs")
    assert (found["points"], found["without_value"]) == (n - 2, 1)
    assert found["mean"]["difference"] == pytest.approx(off, abs=0.2)
    assert (found["p"] > 0.01) == (off == 0.0)


@pytest.fixture
def falls(tmp_path):
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


def told(falls):
    """The table's rows and the text below it."""
    text = pages.filled("bulk_processes", falls.parent)
    return [line for line in text.splitlines() if line.startswith("|")][2:], " ".join(text.split())


def test_speeds_stand_beside_this_engine_s(falls):
    assert told(falls)[0] == [
        "| a | 1,000 | 20 | 4 (1/5) | not run | not run |",
        "| b | 1,000 | 10 | not run | not run | 1 (1/10) |",
    ]


def test_falls_are_compared_where_both_were_looked_at(falls):
    assert tells(told(falls)[1], "20 ms", "0.50 radii of a grain in LIGGGHTS")
    assert tells(told(falls)[1], "Afterwards", "2.00 in LIGGGHTS")
    found = values.falls(falls)
    assert values.apart(found["dem"], found["liggghts"]) == pytest.approx((0.5, 2.0))


def test_a_fall_is_judged_by_the_starts_scatter(falls):
    """Five starts end at 0 to 4 hundredths of a millimetre: mean 2, standard deviation the root of
    2.5, so that one more is expected within the root of 3 of two."""
    path = falls / f"{values.FALL}.liggghts.csv"
    found = values.falls(falls)
    assert values.chances(found, found["liggghts"])[0] < 1e-6
    assert tells(told(falls)[1], "not chance")
    fall = pd.read_csv(path)
    fall.loc[40, "height_m"] = 0.04 + 1e-5 * (2.0 + 3.0**0.5 * 2.776445)  # t of 5 % on 4
    fall.to_csv(path, index=False)
    found = values.falls(falls)
    assert values.chances(found, found["liggghts"]) == [pytest.approx(0.05, abs=1e-5)]
    few = {code: found[code] for code in ("dem", "liggghts")}
    assert values.chances(few, found["liggghts"]) == []
