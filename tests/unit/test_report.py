"""The report is one file that needs nothing else, says what the study's files say, and reads at any
width."""

import base64
import io
import json
import re
import zlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from answers import ANSWER
from calibration import figures
from calibration.stages.screening import half_normal, pareto
from calibration.study.stage import load_stages
from calibration.telling.report.build import build
from calibration.telling.report.sheet import DRAWN as PICTURE
from calibration.telling.report.sheet import HEIGHT, LEVELS, WIDTH, heaps
from dem.fingerprint import engine_fingerprint
from dem.measure.heap import measure_heap
from dem.results import run_name, write_result
from dem.spec import parse_spec
from facts import tells
from stage_files import write

STAGES = load_stages("calibration.stages", "diagnosis.declared", "paper.stages")
OPTIMUM = {
    "optimum": {"c_d": 0.25},
    "solution_set": {"c_d": [0.2, 0.3]},
    "interval_95_others_held": {"c_d": [0.24, 0.31]},
    "attainable": True,
    "target": 45.26,
    "predicted": 45.26,
    "rule": "closest_to_centre",
    "confirmation_interval": [44.9, 45.6],
    "confirmation_runs": 25,
}
VALIDATION = {
    "simulated_mean": 45.68,
    "simulated_n": 25,
    "measured_mean": 45.26,
    "relative_error_percent": 0.93,
    "difference": 0.42,
    "difference_low": 0.0,
    "difference_high": 0.84,
    "margin": 1.0,
    "equivalent": True,
    "equivalence_p": 0.004,
    "equivalence_low": 0.07,
    "equivalence_high": 0.77,
    "t_p": 0.05,
}
VERDICT = {
    "verdict": "identified",
    "causes": ["liquid_bridge"],
    "reason": "it alone passes its null",
    "calibration": {"c_d": {"value": 0.24, "low": 0.21, "high": 0.27}},
    "next_measurement": {"experiment": "heap", "levers": {"moisture_percent": 2.0}},
}


def make_run(root, seed, height, stands=True):
    """A finished heap of a few hundred grains, as a run leaves it, without its angle where it does
    not stand; returns its name."""
    line = np.arange(-0.03, 0.031, 0.002)
    x, y, z = (a.ravel() for a in np.meshgrid(line, line, line[line >= 0.0] + 0.001))
    position = np.column_stack([x, y, z])[z < height - np.hypot(x, y) * height / 0.03]
    radius, zero = np.full(len(position), 0.001), np.zeros_like(position)
    spec = parse_spec({"experiment": "heap", "seed": seed})
    name = run_name(spec)
    folder = root / "results" / "runs" / name
    folder.mkdir(parents=True)
    np.savez(
        folder / "final.npz",
        position=position,
        radius=radius,
        velocity=zero,
        tag=np.arange(len(position)),
    )
    metrics = measure_heap(position, radius, zero, 0.04) | {"in_funnel": 7} if stands else {}
    numerics = {"wall_time_s": 60.0, "steps": 1000, "simulated_time_s": 1.0}
    refused = {"refused": {"kind": "unmeasured", "reason": "no heap"}}
    write_result(folder, spec, metrics, numerics if stands else refused)
    return name


@pytest.fixture(scope="module")
def study(tmp_path_factory, request):
    """A study with every kind of part, in a folder that looks like the project's; it is read
    only."""
    tmp_path = tmp_path_factory.mktemp("project")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        yield make_study(tmp_path, request.config.rootpath)


def make_study(tmp_path, root):
    (tmp_path / "workflow").symlink_to(root / "workflow")
    folder = tmp_path / "results" / "salt"
    (folder / "screening").mkdir(parents=True)
    effects = pd.DataFrame({"code": ["A", "B"], "effect": [1.0, -3.0], "name": ["a_b", "c_d"]})
    effects.to_csv(folder / "screening" / "effects.csv", index=False)
    table = effects.assign(half_normal_score=[0.3, 1.1])
    figures.save(half_normal(table, ["B"], figures.ANGLE), folder / "screening" / "half_normal.svg")
    figures.save(pareto(table, 2.0, 2.5, 0.05, figures.ANGLE), folder / "screening" / "pareto.svg")
    names = [make_run(tmp_path, 3 + k, 0.012 + 0.006 * k) for k in range(3)]
    for k, name in enumerate(names):
        picture = folder / "heaps" / "screening" / f"{name}.webp"
        picture.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGB", (480, 300), (90 * k, 120, 150)).save(picture)
    runs = pd.DataFrame({"run": [1, 2, 3], "run_id": names, "response": [20.0, 30.0, 40.0]})
    for stage in ("screening", "validation"):
        (folder / stage).mkdir(exist_ok=True)
        for file in ("design", "runs"):
            runs.to_csv(folder / stage / f"{file}.csv", index=False)
    summary = {"significant": ["c_d"], "factors": ["c_d"], "alpha": 0.05}
    summary |= {"effects": {"c_d": 4.0}, "p": {"c_d": 0.01}}
    write(folder / "screening" / "screening.json", summary)
    write(folder / "optimise" / "optimum.json", OPTIMUM)
    write(
        folder / "response_surface" / "region.json",
        [{"name": "c_d", "key": "c.d", "low": 0.15, "high": 0.35}],
    )
    pd.DataFrame({"c_d": np.linspace(0.2, 0.3, 500)}).to_csv(
        folder / "optimise" / "solution_set.csv", index=False
    )
    write(folder / "validation" / "validation.json", VALIDATION)
    write(folder / "answer" / "answer.json", ANSWER.model_dump_json())
    write(folder / "diagnosis" / "verdict.json", VERDICT)
    write(folder / "numerics" / "numerics.csv", "variant,difference\nfine,0.2\n")
    write(folder / "reproduction" / "reproduction.csv", "printed,paper,ours\nR2,0.98,0.979\n")
    write(folder / "scaling" / "scaling.json", {"exponent": 1.5})
    write(folder / "scaling" / "scaling.csv", "scale,angle\n1,45\n")
    figures.save(pareto(table, 2.0, 2.5, 0.05, figures.ANGLE), folder / "scaling" / "scaling.svg")
    write(folder / "audit" / "audit.csv", "claim,verdict\nfirst,agrees\nsecond,disagrees\n")
    write(folder / "calibrated.yaml", "c_d: 0.25\n")
    write(folder / "exports" / "liggghts.in", 'fix m1 all property/global "c" <1> 0.25\n')
    return folder


@pytest.fixture(scope="module")
def page(study):
    build(study, study / "report.html", STAGES)
    return (study / "report.html").read_text()


def text_of(page):
    return re.sub(
        r"\s+", " ", re.sub(r"<[^>]+>", " ", re.sub(r"<script.*?</script>", "", page, flags=re.S))
    )


def test_it_asks_for_nothing_outside_itself(page):
    # addresses appear only as the names of XML vocabularies
    assert not re.search(r"(src|href|url\()=?.https?:", page.replace("xlink:href", "href"))
    assert "@import" not in page


def test_every_part_is_there_with_its_numbers(page):
    keys = re.findall(r'<section[^>]*id="(\w+)"', page)
    parts = ["screening", "optimise", "validation", "diagnosis", "scaling", "reproduction"]
    for key in [*parts, "numerics", "audit", "runs", "exports"]:
        assert key in keys
    text = text_of(page)
    for facts in (
        ("p &lt; 0.05", "c d"), ("next", "heap", "moisture percent 2"),
        ("3 runs", "3.0 minutes", engine_fingerprint()), ("run 2", "30.00°", "7 grains", "funnel"),
        ("2 in all", "1 agrees", "1 disagrees"), ("paper beside ours",), ("60 of 500",),
    ):  # fmt: skip
        assert tells(text, *facts), facts
    assert text.index("second disagrees") < text.index("first agrees")


def test_every_figure_has_a_sentence_and_its_data(page):
    charts = re.findall(r'<figure class="chart.*?</figure>', page, flags=re.S)
    assert len(charts) == 3
    for chart in charts:
        caption = re.search(r"<figcaption>(.*?)</figcaption>", chart, flags=re.S).group(1)
        assert re.search(r"\w+ \w+.*\.", caption)
        assert "download=" in caption
    assert unpacked(page, "screening_effects.csv").startswith("code,effect,name\nA,1.0")


def unpacked(page, name):
    """Text of a file that the page carries."""
    files = re.search(r'<script id="files"[^>]*>(.*?)</script>', page, flags=re.S).group(1)
    return zlib.decompress(base64.b64decode(json.loads(files)[name])).decode()


def test_every_download_is_in_the_page_once(page):
    files = json.loads(re.search(r'<script id="files"[^>]*>(.*?)</script>', page).group(1))
    assert set(re.findall(r'<a download="([^"]+)"', page)) == set(files)
    assert "data:text" not in page


def test_one_sheet_shows_every_heap(page, study):
    (image,) = set(re.findall(r"url\((data:image/webp;base64,[^)]+)\)", page))
    assert len(re.findall("data:image/webp", page)) == 1
    with Image.open(io.BytesIO(base64.b64decode(image.partition(",")[2]))) as sheet:
        assert sheet.size == (3 * WIDTH, HEIGHT)
        places = re.findall(r'aria-label="(run (\d).*?)" style="--x: (\d+); --y: (\d+)"', page)
        assert len(places) >= 3
        for _, run, x, y in places:  # each picture has a colour of its own
            middle = int((int(x) + 0.5) * WIDTH), int((int(y) + 0.6) * HEIGHT)
            colour = sheet.convert("RGB").getpixel(middle)
            assert colour == pytest.approx((90 * (int(run) - 1), 120, 150), abs=12)
    shown = re.findall(r'<button type="button" class="heap[^"]*">.*?aria-label="run (\d)', page)
    assert shown == ["1", "2", "3"]


def test_a_run_without_a_value_has_a_picture_with_the_reason(tmp_path, monkeypatch):
    """The same words on the top of both pictures, of grains that form no heap and of none."""
    monkeypatch.chdir(tmp_path)
    names = [make_run(tmp_path, seed, 0.004, stands=seed == 1) for seed in (1, 2, 3)]
    bare = tmp_path / "results" / "runs" / names[2]
    none = {k: np.zeros((0, 3) if k in ("position", "velocity") else 0)
            for k in ("position", "radius", "velocity", "tag")}  # fmt: skip
    np.savez(bare / "final.npz", **none)
    refused = {"refused": {"kind": "unmeasured", "reason": "no heap"}}
    write_result(bare, parse_spec({"experiment": "heap", "seed": 3}), {}, refused)
    pd.DataFrame({"run_id": names}).to_csv("design.csv", index=False)
    heaps(None, SimpleNamespace(design=Path("design.csv")), ["heaps"])
    tops = []
    for name in names:
        with Image.open(tmp_path / "heaps" / f"{name}.webp") as picture:
            tops.append(np.asarray(picture.convert("L"), float)[:24, : PICTURE // 2])
    assert (tops[2] < 100).sum() > 50  # nothing else is dark where no grain is
    assert np.abs(tops[1] - tops[2]).mean() < 5.0
    assert np.abs(tops[0] - tops[2]).mean() > 10.0


def test_a_page_names_the_declared_files_that_it_lacks(tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    study = make_study(tmp_path, request.config.rootpath)
    lacking = ("effects.csv", "pareto.svg")
    for name in lacking:
        (study / "screening" / name).unlink()
    told = build(study, study / "report.html", STAGES)
    page = (study / "report.html").read_text()
    (section,) = re.findall(r'<section id="screening".*?</section>', page, re.S)
    for text in (section, *(line for line in told if "screening" in line)):
        assert tells(text, *lacking)
        assert "half_normal.svg" not in text
    assert any("screening" in line for line in told)
    assert not [line for line in told if "numerics" in line and "numerics.csv" in line]


def test_the_viewer_holds_the_heaps_grains(page, study):
    scenes = json.loads(re.search(r'id="scenes"[^>]*>(.*?)</script>', page, flags=re.S).group(1))
    names = [s["name"].split() for s in scenes]
    assert [(name[0].rstrip(","), name[-1]) for name in names] == [
        ("calibrated", "30.00°"), ("lowest", "20.00°"), ("highest", "40.00°"),
    ]  # fmt: skip
    packed = np.frombuffer(base64.b64decode(scenes[0]["grains"]), "<u2").reshape(-1, 4)
    state = (packed / LEVELS * 2.0 - 1.0) * scenes[0]["scale"]
    name = pd.read_csv(study / "screening" / "runs.csv")["run_id"][1]
    saved = np.load(study.parent / "runs" / name / "final.npz")
    assert state[:, :3] == pytest.approx(1e3 * saved["position"], abs=2e-3)
    assert state[:, 3] == pytest.approx(1e3 * saved["radius"], abs=2e-3)


def test_stages_that_have_not_run_are_left_out(tmp_path):
    empty = tmp_path / "none"
    empty.mkdir()
    build(empty, empty / "report.html", STAGES)
    assert re.findall(r'<section[^>]*id="(\w+)"', (empty / "report.html").read_text()) == ["answer"]


GROUND = "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)"
INK = (
    "getComputedStyle(document.querySelector('figure.chart svg "
    "text')).fill.match(/\\d+/g).map(Number)"
)
# against the device's width: window.innerWidth of a phone grows with what overflows
OVERFLOW = "document.documentElement.scrollWidth"
ANSWER_OVERFLOW = """Math.max(...[...document.querySelectorAll('.answer td, .answer dd')].map(
  cell => cell.getBoundingClientRect().right))"""


@pytest.mark.parametrize(("width", "scheme"), [(390, "dark"), (1280, "light")])
def test_the_page_reads_in_a_browser(tab, page, study, width, scheme):
    address = (study / "report.html").as_uri()
    tab.open(address, width, 844, scheme)
    assert tab.evaluate(OVERFLOW) <= width
    assert tab.evaluate(ANSWER_OVERFLOW) <= width
    assert tab.complaints() == []
    assert tab.requests() == [address]
    ground, ink = np.mean(tab.evaluate(GROUND)), np.mean(tab.evaluate(INK))
    assert (ground > 200 > 100 > ink) if scheme == "light" else (ground < 60 < 180 < ink)
