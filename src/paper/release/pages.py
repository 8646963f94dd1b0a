"""Writes the pages from the kept results: docs/results.md, the README's rows and what it says of
them, the paper's simulations beside ours, and the page of the verification."""

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import jinja2

from calibration.files import write_text
from calibration.intake.tables import read_written
from calibration.telling.kept_results import put
from paper.reference import BEGIN, END, PAGE, README, blocks, told
from paper.release import (
    bulk_processes,
    code_studies,
    comparison,
    deck_trials,
    first_screen,
    joint,
    profiles,
    simulations,
)
from paper.release import told as values
from paper.release.record import KEPT, made, read_record
from paper.release.softening import softening

TEMPLATES = Path(__file__).parent
STUDIES = ("salt", "opened rig", "rigs", "screening at other seeds", "numerics")
CASE = Path("docs/diagnosis-paper-case.md")
VERDICT = "<!-- verdict: begin -->", "<!-- verdict: end -->"
PROFILES = Path("docs/salt-study.md")
JOINT = Path("docs/joint-studies.md")
CODES = Path("docs/code-studies.md")
WAYS = Path("docs/method-comparison.md")
BULK = Path("docs/bulk-processes.md")
DECKS = Path("docs/verification-engines.md")
TRIALS = "<!-- trials: begin -->", "<!-- trials: end -->"
SAID = "<!-- said: begin -->", "<!-- said: end -->"
WIDTH = 100
ASIS = ("#", "|", "<!--", "```", "![", "`salt", "All tables")


def results_page(kept: str | Path = KEPT) -> str:
    """Text of docs/results.md, from the folder of kept results."""
    kept = Path(kept)
    salt, printed, opened = (kept / name for name in ("salt", "salt-printed", "salt-opened"))
    found = {
        "made": made(STUDIES, read_record(kept / "release.json")),
        "table": "@table@",
        "found": "@found@",
        "funnels": values.funnels(salt),
        "printed_funnels": values.funnels(printed),
        "screen": values.screening(salt),
        "printed_screen": values.screening(printed),
        "validated": values.validated(salt),
        "printed_validated": values.validated(printed),
        "surface": values.surface(salt),
        "printed_surface": values.surface(printed),
        "opened": {
            "lost": values.lost(opened),
            "validated": values.validated(opened),
            "surface": values.surface(opened),
            "posterior": values.posterior(opened),
        },
        "fit": values.printed_fit(),
        "posterior": values.posterior(salt),
        "printed_posterior": values.posterior(printed),
        "locus": values.locus(salt),
        "scaling": values.scaling(salt),
        "simulations": simulations.of_heaps(salt),
        "trials": values.trials(kept),
        "rigs": values.rigs(kept / "rigs"),
        "table_13": values.table_13(),
        "softening": softening(read_written(salt / "numerics" / "numerics.csv")),
        "audited": values.audited(),
        "seeds": values.other_seeds(kept),
        "speed": values.speeds(),
    }
    text = _filled("results.md.j2", found)
    return text.replace("@table@", blocks(salt)[PAGE]).replace("@found@", told(salt))


def _filled(template, found):
    """Text of a template with its values, wrapped."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    environment.globals["listed"] = first_screen.listed
    words = (TEMPLATES / template).read_text(encoding="utf-8")
    return wrapped(environment.from_string(words).render(found))


def pieces(kept: str | Path = KEPT) -> dict[tuple[Path, str, str], str]:
    """{(page, begin, end): text between these marks} of the pages that only a part of is written:
    the README's table and what it says, the studies by all their tests, bulk processes in several
    codes, and the paper's simulations beside ours."""
    kept = Path(kept)
    return {
        (README, BEGIN, END): blocks(kept / "salt")[README],
        (README, *SAID): _filled("readme.md.j2", first_screen.values(kept)).strip(),
        (PROFILES, *SAID): _filled("profiles.md.j2", profiles.values(kept / "salt")).strip(),
        (CASE, *VERDICT): verdict((kept / "salt-diagnosis" / "diagnosis.md").read_text("utf-8")),
        (JOINT, *SAID): _filled("joint.md.j2", joint.values(kept)).strip(),
        (CODES, *SAID): _filled("code_studies.md.j2", code_studies.values(kept)).strip(),
        (WAYS, *SAID): _filled("comparison.md.j2", comparison.values(kept)).strip(),
        (BULK, *SAID): _filled("bulk_processes.md.j2", bulk_processes.values(kept)).strip(),
        (DECKS, *TRIALS): _filled("deck_trials.md.j2", deck_trials.values()).strip(),
        (CASE, *SAID): _filled("simulations.md.j2", simulations.values(kept / "salt")).strip(),
    }


def verdict(page: str) -> str:
    """A diagnosis's own page as a part of another: without its title and figures, headings a
    level down."""
    lines = page.split("\n")
    kept = [line for line in lines if not line.startswith(("# ", "!["))]
    lower = [f"#{line}" if line.startswith("## ") else line for line in kept]
    return re.sub(r"\n{3,}", "\n\n", wrapped("\n".join(lower)).strip())


def wrapped(text: str) -> str:
    """Paragraphs and items of a Markdown text filled to WIDTH columns anew; headings, tables, code
    and marks stay as they are."""
    out, held = [], []  # type: ignore[var-annotated]

    def flush():
        if held:
            hang = "  " if held[0].startswith("- ") else ""
            filled = textwrap.fill(
                " ".join(line.strip() for line in held), WIDTH, subsequent_indent=hang,
                break_long_words=False, break_on_hyphens=False,
            )  # fmt: skip
            out.extend(filled.split("\n"))
            held.clear()

    code = False
    for line in text.split("\n"):
        fence = line.startswith("```")
        if code or fence or not line.strip() or line.startswith((*ASIS, "@")):
            flush()
            out.append(line)
            code ^= fence
            continue
        if line.startswith("- "):
            flush()
        held.append(line)
    flush()
    return "\n".join(out)


def write_pages(kept: str | Path = KEPT, verification: bool = True, root: str | Path = ".") -> None:
    """Write every page that shows a release's data into the folder `root`; verification: the one
    of the verification tests too."""
    write_text(results_page(kept), Path(root) / PAGE)
    for (page, begin, end), text in pieces(kept).items():
        put(Path(root) / page, text, begin, end)
    if verification:
        subprocess.run([sys.executable, "tests/verification/page.py"], check=True)
