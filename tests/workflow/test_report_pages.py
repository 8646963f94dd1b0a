"""The pages of a finished study, the workflow's own and Snakemake's: of the test profile, which CI
has just run."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STUDY = ROOT / "results" / "salt-test"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (STUDY / "report.html").exists(),
        reason="no study: `snakemake --profile profiles/test` makes it",
    ),
]


@pytest.fixture(scope="module")
def page():
    return (STUDY / "report.html").read_text()


def test_every_stage_and_every_heap_is_on_the_page(page):
    for key in (
        "heap",
        "screening",
        "ascent",
        "response_surface",
        "optimise",
        "validation",
        "runs",
    ):
        assert f'<section id="{key}"' in page
    planned = sum(
        len(json.loads((STUDY / stage / "plan.json").read_text()))
        for stage in ("screening", "ascent", "response_surface", "candidate", "validation")
    )
    assert len(re.findall(r'src="data:image/webp', page)) >= planned
    assert len(page) < 8e6


def test_every_figure_of_the_chain_is_on_the_page(page):
    chain = ("screening", "ascent", "response_surface", "optimise", "validation")
    drawn = [path for stage in chain for path in (STUDY / stage).glob("*.svg")]
    assert drawn
    for path in drawn:
        assert f'id="{path.parent.name}-{path.stem}-figure_1"' in page


def test_snakemake_makes_its_own_report_with_captions(tmp_path):
    out = tmp_path / "report.html"
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--profile", "profiles/test", "--report", str(out)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    text = out.read_text()
    for category in ("1 Screening", "4 Optimum", "8 Heaps"):
        assert category in text
    for caption in ("half_normal", "contours", "validation", "heaps"):
        words = (ROOT / "workflow" / "report" / f"{caption}.rst").read_text().split(".")[0]
        assert words[:40] in text
