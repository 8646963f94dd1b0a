"""Writes the pages from the kept results: docs/results.md, the README's rows, and the page of the
verification."""

import subprocess
import sys
import textwrap
from pathlib import Path

import jinja2

from calibration.files import write_text
from calibration.intake.tables import read_written
from calibration.telling.kept_results import put
from paper.reference import BEGIN, END, PAGE, README, blocks, told
from paper.release import told as values
from paper.release.record import KEPT, made, read_record
from paper.release.softening import softening

TEMPLATE = Path(__file__).parent / "results.md.j2"
STUDIES = ("salt", "salt-slow", "salt-paper", "screening at other seeds", "numerics")
WIDTH = 100
ASIS = ("#", "|", "<!--", "```", "![", "`salt", "All tables")


def results_page(kept: str | Path = KEPT) -> str:
    """Text of docs/results.md, from the folder of kept results."""
    kept = Path(kept)
    salt, slow = kept / "salt", kept / "salt-slow"
    found = {
        "made": made(STUDIES, read_record(kept / "release.json")),
        "table": "@table@",
        "found": "@found@",
        "funnels": values.funnels(salt),
        "screen": values.screening(salt),
        "slow": values.screening(slow),
        "validated": values.validated(salt),
        "slow_validated": values.validated(slow),
        "surface": values.surface(salt),
        "slow_surface": values.surface(slow),
        "posterior": values.posterior(salt),
        "slow_posterior": values.posterior(slow),
        "locus": values.locus(salt),
        "scaling": values.scaling(salt),
        "pour": values.slow_pour(kept / "salt-paper"),
        "rigs": values.rigs(kept / "rigs"),
        "table_13": values.table_13(),
        "softening": softening(read_written(salt / "numerics" / "numerics.csv")),
        "audited": values.audited(),
        "seeds": values.other_seeds(kept),
        "speed": values.speeds(),
    }
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    text = wrapped(template.render(found))
    return text.replace("@table@", blocks(salt)[PAGE]).replace("@found@", told(salt))


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
    put(Path(root) / README, blocks(Path(kept) / "salt")[README], BEGIN, END)
    if verification:
        subprocess.run([sys.executable, "tests/verification/page.py"], check=True)
