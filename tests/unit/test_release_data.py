"""A release's data: what each part's time is expected to be, what is left after a cut, and that the
pages say what the data say."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from calibration.errors import CalibrationError
from calibration.telling.kept_results import put
from facts import refused, tells
from frozen import FROZEN
from paper.reference import BEGIN, END, PAGE, README, blocks
from paper.release import command, pages, told
from paper.release.parts import PARTS, Part, estimate
from paper.release.record import Made, due, made, read_record, write_record


@pytest.fixture
def repository(monkeypatch, request):
    monkeypatch.chdir(request.config.rootpath)


def test_the_pages_show_the_release_s_data(repository):
    assert pages.results_page() == PAGE.read_text()
    shown = README.read_text().split(BEGIN)[1].split(END)[0].strip()
    assert shown == blocks("results/reference/salt")[README]


def test_the_pages_are_written_as_they_are_kept(repository, tmp_path):
    for path, text in ((PAGE, "old"), (README, f"{BEGIN}\nold\n{END}\n")):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text)
    pages.write_pages(verification=False, root=tmp_path)
    assert (tmp_path / PAGE).read_text() == PAGE.read_text()
    assert (tmp_path / README).read_text().strip() in README.read_text()


def test_the_results_page_names_its_engine_once(repository):
    text = PAGE.read_text()
    for engine in {m.engine for m in read_record().values() if m.engine in text}:
        assert text.count(engine) == 1
    assert "before" not in " ".join(re.findall(r"[^.]*\bengine\b[^.]*", pages.results_page(FROZEN)))


def test_no_page_speaks_of_an_engine_before(repository):
    folders = ("docs", "examples", "config", "tests/verification/notes")
    places = [Path("README.md"), *(p for f in folders for p in Path(f).rglob("*.md"))]
    words = r"(earlier|former|old|older|previous) engine|engine before (gave|let|this|they)"
    words += "|by the engine before"
    for path in places:
        assert not re.search(words, path.read_text()), path


def test_effects_and_funnels_are_those_of_the_tables():
    table = pd.read_csv(FROZEN / "salt" / "funnels.csv")
    runs = table[table["stage"] != "screening"].dropna()
    packed = runs["hold_up"] > 1250
    # the two kinds lie apart in what the funnel held
    held = runs["hold_up"]
    assert held[packed].min() - held[~packed].max() > 2 * held[~packed].std()
    found = told.funnels(FROZEN / "salt")
    assert (found["packed"], found["runs"]) == (packed.sum(), len(runs))
    steep, flat = (runs["angle_of_repose_deg"][k] for k in (packed, ~packed))
    error = np.hypot(stats.sem(steep), stats.sem(flat))
    assert found["steeper"] == f"{steep.mean() - flat.mean():.1f}° ± {error:.1f}°"
    effects = pd.read_csv(FROZEN / "salt-slow" / "screening" / "effects.csv").set_index("code")
    slow = told.screening(FROZEN / "salt-slow")
    assert slow["effect"]["G"] == f"+{effects['effect']['G']:.1f}°"
    assert slow["printed"]["G"] == "+15.56°"  # Table 7 of the paper


def test_other_seeds_are_counted_together():
    seeds = told.other_seeds(FROZEN)
    runs = [pd.read_csv(FROZEN / n / "screening" / "runs.csv") for n in told.SEEDS.values()]
    assert seeds["heaps"] == sum(r["response"].notna().sum() for r in runs)
    assert [row["seed"] for row in seeds["rows"]] == [1, 2, 3, 4]
    # balanced columns: an effect is the difference of the means of its levels, run by run
    whole = [r for r in runs if r["response"].notna().all()]
    g = pd.concat(whole)
    effect = g.loc[g["G"] > 0, "response"].mean() - g.loc[g["G"] < 0, "response"].mean()
    full = [r["response"].notna().all() for r in runs]
    each = [row["found"] for row, kept in zip(seeds["rows"], full, strict=True) if kept]
    said = [
        float(re.search(r"rolling friction of salt on salt \+(\d+\.\d)", text)[1]) for text in each
    ]
    assert np.mean(said) == pytest.approx(effect, abs=0.06)


def test_text_is_filled_and_tables_are_left():
    text = "# A heading\n\n- one\n  two " + "word " * 30 + "\n\n| a | b |\n"
    lines = pages.wrapped(text).split("\n")
    assert lines[0] == "# A heading"
    assert lines[2].startswith("- one two word")
    assert lines[3].startswith("  word")
    assert max(map(len, lines)) <= 100
    assert "| a | b |" in lines


def test_a_part_takes_what_it_took_and_before_that_what_its_heaps_take(tmp_path):
    history = tmp_path / "history.csv"
    history.write_text("case,wall_time_s\nfunnel heap,20\nfunnel heap,30\n")
    runs = tmp_path / "kept" / "s" / "screening"
    runs.mkdir(parents=True)
    (runs / "runs.csv").write_text("run_id,experiment\na,heap\nb,heap\nb,heap\nc,tilt\n")
    part = Part("s", "", (), heaps=("s",))
    assert estimate(part, {}, history, 2, tmp_path / "kept") == (30.0, "2 heaps")
    timed = {"s": Made("e", "2026-01-01", 100.0, 4)}
    assert estimate(part, timed, history, 2, tmp_path / "kept") == (200.0, "recorded")
    assert estimate(Part("t", "", ()), {}, history, 2, tmp_path / "kept")[0] is None


def test_a_record_is_read_as_written_and_says_which_engine_made_what(tmp_path):
    record = {"a": Made("e1", "2026-01-01", 3.5, 2), "b": Made("e2", "2026-01-02")}
    write_record(record, tmp_path / "release.json")
    assert read_record(tmp_path / "release.json") == record
    assert tells(made(["a"], record), "`e1`", "2026-01-01")
    both = made(["a", "b", "c"], record)
    assert tells(both, "`a`", "`e1`", "2026-01-01")
    assert tells(both, "`b`", "`e2`", "2026-01-02")
    assert "`c`" not in both


def test_a_release_is_due_where_another_engine_made_a_part():
    record = {"salt": Made("a" * 16, "2026-11-25"), "numerics": Made("b" * 16, "2026-11-25")}
    assert due(["salt", "numerics", "soybean"], record, "a" * 16) == ["numerics", "soybean"]


def test_a_release_that_was_cut_off_goes_on_and_books_its_time(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("benchmarks").mkdir()
    Path("benchmarks/history.csv").write_text("case,wall_time_s\n")
    Path("results/a").mkdir(parents=True)
    Path("results/a/table.csv").write_text("x\n1\n")
    code = "import pathlib,sys; p = pathlib.Path('{}'); n = p.exists(); p.touch(); sys.exit(not n)"
    once = (sys.executable, "-c", code.replace("{}", "tried").replace("{", "{{"))
    parts = (
        Part("a", "first", ((sys.executable, "-c", "print(1)"),), copies=(("results/a", "a"),)),
        Part("b", "fails at first", (once,)),
    )
    for module in (command,):
        monkeypatch.setattr(module, "PARTS", parts)
    monkeypatch.setattr(command, "part_of", lambda n: next((p for p in parts if p.name == n), None))
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
    assert read_record()["b"].engine == "e" * 16
    assert json.loads(Path(f"results/release/{'e' * 16}.json").read_text())["spent_s"]["b"] > 0.0
    assert command.main(["c"]) == 2
    assert tells(capsys.readouterr().err, "c", "no part", "a, b")


def test_every_part_names_what_exists(repository):
    known = {p.name for p in PARTS}
    assert set(read_record()) <= known
    for part in PARTS:
        for name in part.heaps:
            assert (Path("results/reference") / name).is_dir()
    with refused(CalibrationError, "README.md"):
        put("README.md", "text")
