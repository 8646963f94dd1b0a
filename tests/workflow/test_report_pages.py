"""The pages of a finished study, the workflow's own and Snakemake's: of the test profile, which CI
has just run."""

import base64
import re

import pytest

from calibration.telling.report.embed import READABLE
from facts import ROOT
from started import python

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


LETTERS = """[...document.querySelectorAll('figure.chart svg text')].map(t => {
  const m = t.getScreenCTM();
  return parseFloat(getComputedStyle(t).fontSize) * Math.hypot(m.a, m.b); })"""


def test_the_letters_of_figures_can_be_read_on_a_phone(tab, page):
    tab.open((STUDY / "report.html").as_uri(), 390, 844)
    letters = tab.evaluate(LETTERS)
    assert letters
    assert min(letters) >= 0.98 * READABLE


MAIN_PAGES = 12


def pages(paper):
    return len(re.findall(rb"/Type\s*/Page\b", paper))


def test_paper_shows_every_section_and_no_empty_viewer(tab, page):
    tab.open((STUDY / "report.html").as_uri(), 1280, 844)
    paper = base64.b64decode(tab.call("Page.printToPDF", printBackground=False)["data"])
    assert paper.startswith(b"%PDF")
    assert len(paper) < 20e6
    assert pages(paper) <= 45  # every table and block is open
    tab.evaluate(
        "document.head.append(Object.assign(document.createElement('style'),"
        " { textContent: '@media print { #annex { display: none !important } }' }))"
    )
    main = base64.b64decode(tab.call("Page.printToPDF", printBackground=False)["data"])
    assert 1 < pages(main) <= MAIN_PAGES
    tab.evaluate("document.head.lastElementChild.remove()")
    tab.call("Emulation.setEmulatedMedia", media="print")
    shown = "[...document.querySelectorAll('%s')].filter(e => e.checkVisibility()).length"
    assert tab.evaluate(shown % "canvas") == 0
    assert tab.evaluate(shown % ".still .picture") == 1
    assert tab.evaluate(shown % "main section") == page.count("<section")
    tab.call("Emulation.setEmulatedMedia", media="screen")


def test_snakemake_makes_its_own_report_with_captions(tmp_path):
    out = tmp_path / "report.html"
    python(ROOT, *"-m snakemake --profile profiles/test --report".split(), out)
    text = out.read_text()
    for category in ("1 Screening", "4 Optimum", "8 Heaps"):
        assert category in text
    for caption in ("half_normal", "contours", "validation", "heaps"):
        words = (ROOT / "workflow" / "report" / f"{caption}.rst").read_text().split(".")[0]
        assert words[:40] in text
