"""A release: its pages say what its data say, and it makes what is not of the present engine."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from benchmarks import code_studies
from facts import tells
from frozen import FROZEN
from paper.reference import PAGE
from paper.release import command, pages, values
from paper.release.command import due
from paper.release.pages import made, read_record
from paper.release.parts import Part


@pytest.fixture
def repository(monkeypatch, request):
    monkeypatch.chdir(request.config.rootpath)


@pytest.fixture
def kept(tmp_path):
    """The frozen runs as a folder of kept results; the rig as printed is the study's own, in which
    some funnels packed."""
    folder = tmp_path / "kept"
    shutil.copytree(FROZEN, folder)
    shutil.copytree(folder / "salt-paper" / "disagreement", folder / "salt" / "disagreement")
    for rig in ("salt-printed", "salt-opened"):
        shutil.copytree(folder / "salt", folder / rig)
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
    assert pages.results_page() == PAGE.read_text()
    for (page, begin, end), text in pages.pieces().items():
        assert page.read_text().split(begin)[1].split(end)[0].strip() == text


def test_the_first_screen_counts_the_verdicts_of_the_table(repository, kept):
    path = kept / "salt" / "reproduction" / "reproduction.csv"
    table = pd.read_csv(path, dtype={"paper": str}).set_index("id")
    effects = table.loc[[f"table07.{c}.effect" for c in values.FACTORS], "agreement"]
    n = values.counted((effects == "different").sum())
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


def test_the_first_screen_tells_what_all_tests_bound(repository, kept):
    path = kept / "salt" / "joint" / "joint.json"
    found = json.loads(path.read_text())
    names = list(found["parameters"])
    for name, parameter in found["parameters"].items():
        parameter |= {"left": 0.5, "bounded": name in names[:2], "border": None}
        parameter["interval"] = [0.123, 0.456]
    path.write_text(json.dumps(found))
    assert tells(said(kept), "two of seven")
    found["parameters"][names[0]].update(border="low", reach=0.1, reach_is_limit=False)
    found["agreement"] |= {"contradicts": True, "named": ["heap: angle_of_repose_deg"]}
    path.write_text(json.dumps(found))
    assert tells(said(kept), "one of seven")
    assert tells(said(kept), "No parameters", "all of them")


def test_causes_of_several_studies_stand_in_one_ranking(kept, tmp_path):
    """Each with the greatest of its chances: the best of more causes is as good by chance more
    often. The least gain comes last, whichever study tried it."""
    shutil.copytree(kept / "salt", tmp_path / "salt")
    found = json.loads((kept / "salt" / "disagreement" / "disagreement.json").read_text())
    every = [c["cause"] for c in found["Table 10"]["ranking"]]
    for causes, p, gain in (("crossed", 0.5, -90.0), ("rig-causes", 0.2, -80.0)):
        table = found["Table 10"]
        own = table["ranking"][0] | {"cause": causes, "kind": "rig", "gain": gain, "p": 1.0}
        both = [own, *({**c, "p": p} for c in table["ranking"])]
        folder = tmp_path / f"salt-{causes}" / "disagreement"
        folder.mkdir(parents=True)
        written = found | {"Table 10": table | {"ranking": both}}
        (folder / "disagreement.json").write_text(json.dumps(written))
    ranking = values.simulations(tmp_path / "salt")["Table 10"]["ranking"]
    assert [c["cause"] for c in ranking] == [*every, "rig-causes", "crossed"]
    assert {c["p"] for c in ranking[:-2]} == {0.5}


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
    effects = pd.read_csv(FROZEN / "salt-slow" / "screening" / "effects.csv").set_index("code")
    slow = values.screening(FROZEN / "salt-slow")
    assert slow["effect"]["G"] == f"+{effects['effect']['G']:.1f}°"
    assert slow["printed"]["G"] == "+15.56°"  # Table 7 of the paper


def test_other_seeds_are_counted_together():
    seeds = values.other_seeds(FROZEN)
    runs = [pd.read_csv(FROZEN / n / "screening" / "runs.csv") for n in values.SEEDS.values()]
    assert seeds["heaps"] == sum(r["response"].notna().sum() for r in runs)
    assert len(runs) == 4
    table = pd.concat(runs).dropna(subset="response")
    slopes = np.linalg.lstsq(
        np.column_stack([np.ones(len(table)), table[values.FACTORS]]), table["response"], rcond=None
    )[0]
    (said,) = (text for text in seeds["found"] if text.startswith("G "))
    assert said.startswith(f"G +{2 * slopes[values.FACTORS.index('G') + 1]:.1f}°")


def test_a_record_says_which_engine_made_what_and_what_is_due():
    record = {"a": {"engine": "e1", "date": "2026-01-01"}}
    record["b"] = {"engine": "e2", "date": "2026-01-02"}
    assert tells(made(["a"], record), "`e1`", "2026-01-01")
    both = made(["a", "b", "c"], record)
    assert tells(both, "`a`", "`e1`", "2026-01-01")
    assert tells(both, "`b`", "`e2`", "2026-01-02")
    assert "`c`" not in both
    assert due(["a", "b", "c"], record, "e1") == ["b", "c"]


def test_a_release_makes_what_is_not_of_this_engine_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("results/a").mkdir(parents=True)
    Path("results/a/table.csv").write_text("x\n1\n")
    code = "import pathlib,sys; p = pathlib.Path('{}'); n = p.exists(); p.touch(); sys.exit(not n)"
    once = (sys.executable, "-c", code.replace("{}", "tried").replace("{", "{{"))
    parts = (
        Part("a", "first", ((sys.executable, "-c", "print(1)"),), copies=(("results/a", "a"),)),
        Part("b", "fails at first", (once,)),
    )
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


def test_a_joint_study_is_told_beside_one_target(tmp_path):
    """Of a made-up study: shares by which means miss are those of the numbers, and targets that
    contradict are named."""
    folder = tmp_path / "maize"
    rows = {"push_through": 741.0, "joint_push_through": 780.0}
    for stage, mean in rows.items():
        row = {"machine": "bulk", "metric": "poured_density_kg_m3", "mean": mean}
        row |= {"low": mean - 15.0, "high": mean + 15.0, "measured": 760.0}
        (folder / stage).mkdir(parents=True)
        (folder / stage / f"{stage}.json").write_text(json.dumps({"metrics": [row]}))
    target = {"rig": "vessel", "metric": "poured_density_kg_m3", "measured": 760.0}
    target |= {"predicted": 771.0, "pull": -0.8, "pull_others": -1.4, "p_others": 0.2}
    heap = {"rig": "heap", "metric": "angle_of_repose_deg", "measured": 20.0, "predicted": 25.0}
    heap |= {"pull": -5.0, "pull_others": -6.0, "p_others": 0.0}
    parameter = {"interval": [0.2, 0.3], "left": 0.4, "bounded": True, "border": None}
    found = {
        "parameters": {"friction": parameter, "wall": parameter | {"left": 1.0}},
        "box": {"friction": [0.1, 0.5], "wall": [0.1, 0.5]}, "level": 0.95,
        "priors": {"wall": {"mean": 0.25, "sd": 0.03, "source": "a paper"}},
        "runs": {"heap": 96, "vessel": 90}, "targets": [heap, target], "readings": 5,
        "agreement": {"contradicts": True, "p": 0.01, "named": ["heap: angle_of_repose_deg"]},
        "next_test": [], "without_value": {}, "sampler": {"converged": True},
        "correlation": [[1.0, 0.0], [0.0, 1.0]],
    }  # fmt: skip
    (folder / "joint").mkdir()
    (folder / "joint" / "joint.json").write_text(json.dumps(found))
    (folder / "posterior").mkdir()
    table = "parameter,low,high\nfriction,0.15,0.35\n"
    (folder / "posterior" / "parameters.csv").write_text(table)
    study = values.joint(tmp_path / "maize")
    density = study["tests"][1]
    # 741 / 760 and 780 / 760; the heap was run in no machine, and its emulator is told
    assert tells(density["single"], "741", "−2.5 %", "726", "756")
    assert tells(density["joint"], "780", "2.6 %")
    assert study["tests"][0]["single"] == ""
    assert tells(study["tests"][0]["joint"], "25.00°", "+25.0 %")
    assert study["parameters"][0]["single"] == "0.15 to 0.35"
    assert study["largest_pull"] == "6.0"
    found = values.outside({"a": parameter, "b": parameter}, {"a": 0.25, "b": 0.31})
    assert found == ["b (0.31)"]


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_another_code_s_heaps_are_compared_with_ours_at_their_points(
    repository, tmp_path, monkeypatch, share
):
    """Of a made-up code that takes a share of the rolling friction: it is found, and nothing is
    where it takes all."""
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
            angles.append(15.0 + 40.0 * share * rolling + 0.1 * rng.standard_normal())
        (tmp_path / "theirs" / stage).mkdir(parents=True)
        (tmp_path / "theirs" / stage / "plan.json").write_text(json.dumps(specs))
        runs = pd.DataFrame({"run_id": list(specs), "response": angles})
        runs.to_csv(tmp_path / "theirs" / stage / "runs.csv", index=False)
    (tmp_path / "theirs" / "validation").mkdir()
    (tmp_path / "theirs" / "validation" / "validation.json").write_text('{"simulated_sd": 0.1}')
    validated = {f"heap-v{k}": specs["heap-6"] | {"seed": k} for k in range(6)}
    (tmp_path / "theirs" / "validation" / "plan.json").write_text(json.dumps(validated))

    def ours(specs, fraction, root):
        keys = [s["contacts"]["particle_particle"]["rolling_friction"] for s in specs]
        return 15.0 + 40.0 * fraction * np.array(keys) + 0.1 * rng.standard_normal(len(keys))

    monkeypatch.setattr(code_studies, "ours_at", ours)
    found = code_studies.compared(tmp_path / "theirs", tmp_path / "heaps.csv")
    assert found["runs"] == n - 1
    assert found["without_value"] == 0
    assert found["verdict"] == ("agree" if share == 1.0 else "identified")
    if share == 0.5:
        assert found["ranking"][0]["strength"] == share
        # half of a rolling friction of 0.3 on average, times 40
        assert found["mean"]["difference"] == pytest.approx(-6.0, abs=2.0)
