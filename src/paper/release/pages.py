"""Writes the pages from the kept results: docs/results.md, the README's rows and what it says of
them, and the tables of docs/evidence.md and docs/other-codes.md."""

import textwrap
from pathlib import Path

import jinja2

from calibration.files import write_text
from calibration.intake.tables import read_written
from calibration.telling.kept_results import put
from paper.reference import BEGIN, END, PAGE, README, blocks
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
EVIDENCE = Path("docs/evidence.md")
CODES = Path("docs/other-codes.md")
SAID, WAYS, BULK, STUDIES_IN_CODES, TRIALS = (
    (f"<!-- {name}: begin -->", f"<!-- {name}: end -->")
    for name in ("said", "ways", "bulk", "codes", "trials")
)
WIDTH = 100
ASIS = ("#", "|", "<!--", "```", "![", "`salt", "All tables")


def results_page(kept: str | Path = KEPT) -> str:
    """Text of docs/results.md, from the folder of kept results."""
    kept = Path(kept)
    salt, printed, opened = (kept / name for name in ("salt", "salt-printed", "salt-opened"))
    found = {
        "made": made(STUDIES, read_record(kept / "release.json")),
        "table": "@table@",
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
        "simulations": simulations.values(salt),
        "joint": joint.study(kept, "salt"),
        "maize": joint.study(kept, "maize") if (kept / "maize").is_dir() else {"tests": ()},
        "profiles": profiles.values(salt),
        "trials": values.trials(kept),
        "rigs": values.rigs(kept / "rigs"),
        "table_13": values.table_13(),
        "softening": softening(read_written(salt / "numerics" / "numerics.csv")),
        "audited": values.audited(),
        "seeds": values.other_seeds(kept),
        "speed": values.speeds(),
    }
    text = _filled("results.md.j2", found)
    return text.replace("@table@", blocks(salt)[PAGE])


def _filled(template, found):
    """Text of a template with its values, wrapped."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    environment.globals["listed"] = first_screen.listed
    words = (TEMPLATES / template).read_text(encoding="utf-8")
    return wrapped(environment.from_string(words).render(found))


def pieces(kept: str | Path = KEPT) -> dict[tuple[Path, str, str], str]:
    """{(page, begin, end): text between these marks} of the pages that only a part of is written:
    the README's table and what it says, and what is known of ways to calibrate, bulk processes
    and other codes."""
    kept = Path(kept)
    return {
        (README, BEGIN, END): blocks(kept / "salt")[README],
        (README, *SAID): _filled("readme.md.j2", first_screen.values(kept)).strip(),
        (EVIDENCE, *WAYS): _filled("comparison.md.j2", comparison.values(kept)).strip(),
        (EVIDENCE, *BULK): _filled("bulk_processes.md.j2", bulk_processes.values(kept)).strip(),
        (EVIDENCE, *STUDIES_IN_CODES): _filled(
            "code_studies.md.j2", code_studies.values(kept)
        ).strip(),
        (CODES, *TRIALS): _filled("deck_trials.md.j2", deck_trials.values()).strip(),
    }


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


def write_pages(kept: str | Path = KEPT, root: str | Path = ".") -> None:
    """Write every page that shows a release's data into the folder `root`."""
    write_text(results_page(kept), Path(root) / PAGE)
    for (page, begin, end), text in pieces(kept).items():
        put(Path(root) / page, text, begin, end)
