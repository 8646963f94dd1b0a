"""The command line: help, templates, and one line with status 2 for whatever is wrong."""

import json

import pytest
import yaml

from dem.cli import main
from dem.experiments import experiments
from dem.template import template


@pytest.fixture
def heap(tmp_path):
    path = tmp_path / "heap.yaml"
    assert main(["init", "--out", str(path)]) == 0
    return path


@pytest.mark.parametrize("experiment", list(experiments()))
def test_a_template_passes_its_own_check(tmp_path, capsys, experiment):
    path = tmp_path / "spec.yaml"
    assert main(["init", "--experiment", experiment, "--out", str(path)]) == 0
    assert main(["check", str(path)]) == 0
    out, err = capsys.readouterr()
    assert f"a valid {experiment}" in out
    # the paper's funnel passes by Beverloo what it is fed
    assert err == "" or (experiment == "heap" and "Beverloo" in err)


def test_a_template_does_not_overwrite(heap, capsys):
    before = heap.read_text()
    assert main(["init", "--experiment", "drop", "--out", str(heap)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert heap.read_text() == before


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["check", "{folder}/none.yaml"], "none.yaml"),
        (["check", "{folder}"], "directory"),
        (["run", "{folder}/bad.yaml", "--out", "{folder}/o"], "line 2: seed = 'x'"),
        (["run", "{heap}", "--out", "{folder}/o", "--seed", "-1"], "seed = -1"),
        (["run", "{heap}", "--out", "{folder}/o", "--frames", "0"], "output.frame_interval_s"),
        (["run", "{heap}", "--out", "{heap}/o"], "heap.yaml"),
        (["init", "--out", "{folder}/nowhere/spec.yaml"], "nowhere"),
    ],
)
def test_bad_input_is_one_line_and_status_2(tmp_path, heap, capsys, arguments, word):
    (tmp_path / "bad.yaml").write_text("experiment: heap\nseed: x\n")
    filled = [a.format(folder=tmp_path, heap=heap) for a in arguments]
    assert main(filled) == 2
    # the progress bar, where it was begun, ends with a carriage return or a new line of its own
    last = capsys.readouterr().err.rstrip("\n").splitlines()[-1]
    assert last.startswith("dem: ")
    assert word in last
    assert not (tmp_path / "o").exists()


def test_a_drop_runs_and_draws_frames(tmp_path, capsys):
    path = tmp_path / "drop.yaml"
    mapping = yaml.safe_load(template("drop"))
    mapping["geometry"] |= {"drop_height_mm": 20, "drops": 2}
    path.write_text(yaml.safe_dump(mapping))
    out = tmp_path / "out"
    assert main(["run", str(path), "--out", str(out), "--frames", "0.02"]) == 0
    assert "rebound_height_mm" in capsys.readouterr().out
    assert sorted(p.name for p in out.iterdir()) == ["final.npz", "frames", "result.json"]
    times = json.loads((out / "result.json").read_text())["numerics"]["simulated_time_s"]
    assert len(list((out / "frames").glob("grains_*.vtp"))) == int(times / 0.02) + 1
