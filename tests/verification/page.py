"""The site's page of the verification: what the tests recorded in docs/verification.json with the
notes of this folder, and the study of the default numerics where its table is there.
`python tests/verification/page.py` prints it."""

import json
from itertools import groupby
from pathlib import Path

import page_figures
import pandas as pd

from paper.release.pages import made, read_record
from paper.release.values import STIFFER, softening

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
NOTES = Path(__file__).parent / "notes"
RECORD = ROOT / "results" / "reference" / "release.json"
NUMERICS = ROOT / "results" / "reference" / "salt" / "numerics" / "numerics.csv"
BULK = ("Beverloo", "Janssen", "Zhou et al.")
NUMERICS_HEADING = ["## What the default numerics cost in degrees", ""]


def slug(topic):
    """Name of a topic's files."""
    return "_".join("".join(c if c.isalnum() else " " for c in topic.lower()).split())


def table_of(rows):
    """The values of one topic; bold where outside the tolerance."""
    lines = ["| what | engine | reference | tolerance | source |", "|---|---|---|---|---|"]
    for r in rows:
        unit = f" {r['unit']}" if r["unit"] else ""
        cells = [
            "" if r[k] is None else f"{r[k]:.{digits}g}{unit}"
            for k, digits in (("value", 5), ("reference", 5), ("tolerance", 2))
        ]
        if r["tolerance"] is not None and abs(r["value"] - r["reference"]) > r["tolerance"]:
            cells[0] = f"**{cells[0]}**"
        lines.append(f"| {' | '.join([r['quantity'], *cells, r['source']])} |")
    return [*lines, ""]


def picture(name, caption):
    return [f"![{caption}](verification/{name}.svg)", "", caption, ""]


def section(topic, entries):
    """Heading, note, figures and table of one topic."""
    rows = [e for e in entries if "value" in e]
    lines = [f"## {topic[0].upper()}{topic[1:]}", ""]
    note = NOTES / f"{slug(topic)}.md"
    if note.exists():
        lines += [note.read_text()]
    if topic in page_figures.OF_TOPIC:
        lines += picture(slug(topic), page_figures.OF_TOPIC[topic](rows, slug(topic)))
    for e in entries:
        if "figure" in e:
            lines += picture(e["figure"], e["caption"])
    return [*lines, *table_of(rows)]


def engines_of(records):
    """Which engine gave the values, in one sentence; where they are of several, the topics of
    each."""
    topics = {}
    for r in records:
        topics.setdefault(r["engine"], {})[r["topic"]] = None
    if len(topics) == 1:
        return made(["verification"], read_record(RECORD))
    each = [f"`{engine}`: {', '.join(of)}" for engine, of in topics.items()]
    return f"The values are of {len(topics)} engines. {'. '.join(each)}."


def numerics_section(path=NUMERICS):
    """What the default numerics cost in degrees, or a line that says that the study has not been
    run."""
    if not path.exists():
        return [
            *NUMERICS_HEADING,
            "Not measured yet: `snakemake -j2 numerics` writes the table.",
            "",
        ]
    table = pd.read_csv(path)
    columns = (
        "variant, compared with, point, n, angle [°], sd [°], difference [°], 95 % interval [°]"
    )
    lines = [*NUMERICS_HEADING, (NOTES / "numerics.md").read_text()]
    lines += picture("numerics", page_figures.numerics(table))
    lines += [f"| {columns.replace(', ', ' | ')} | within seed spread |", "|---" * 9 + "|"]
    for row in table.to_dict("records"):
        lost = row["without_value"]
        count = f"{row['n']} of {row['n'] + lost}" if lost else f"{row['n']}"
        against = "" if pd.isna(row["against"]) else row["against"]
        means = ("" if pd.isna(row[k]) else f"{row[k]:.2f}" for k in ("mean", "sd"))
        after = ["", "", ""]
        if not pd.isna(row["difference"]):
            within = "yes" if str(row["within_seed_spread"]) == "True" else "no"
            span = f"{row['low']:+.2f} to {row['high']:+.2f}"
            after = [f"{row['difference']:+.2f}", span, within]
        cells = [row["variant"], against, row["point"], count, *means, *after]
        lines.append(f"| {' | '.join(cells)} |")
    if STIFFER in set(table["variant"]):
        lines += ["", softening(table)]
    return [*lines, ""]


def order(record):
    """Bulk material last; the rest by name."""
    topic = record["topic"]
    return (BULK.index(topic) if topic in BULK else -1, topic.lower())


def text():
    """The page; draws the figures that are not the tests' own."""
    records = sorted(json.loads((DOCS / "verification.json").read_text()), key=order)
    head = (NOTES / "head.md").read_text().replace("{made}", engines_of(records))
    lines = [head, *picture("overview", page_figures.overview(records))]
    for topic, entries in groupby(records, key=lambda r: r["topic"]):
        lines += section(topic, list(entries))
    return "\n".join(lines + numerics_section())


if __name__ == "__main__":
    import tempfile

    page_figures.FOLDER = Path(tempfile.mkdtemp())
    print(text())
