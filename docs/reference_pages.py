"""Hook of mkdocs that adds the reference pages, made anew at every build: keys of a study's
configuration and of a run spec, experiments, the command's help, `verdict.json`, what may start
code, the names of the packages, and the tables of the verification.
"""

import contextlib
import csv
import inspect
import io
import json
import os
import posixpath
import re
import sys
import tempfile
from functools import partial
from pathlib import Path

import pandas as pd
import yaml
from mkdocs.structure.files import File

from calibration.atlas.rigs import GRAIN, RIGS
from calibration.atlas.runs import RUNS
from calibration.figures import label
from calibration.interface.commands import main as dem
from calibration.study.config import METRICS, Config
from calibration.study.factors import COLUMNS
from calibration.study.new.assumed import TABLE
from dem.contact.catalogue import every_law, groups_needed, keys_allowed
from dem.experiments import experiments
from dem.spec import GEOMETRY, RunSpec, keys_of
from dem.units import unit_of, without_unit

ROOT = Path(__file__).parents[1]
HEADER = "| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n"


def allowed(field, definitions):
    """What a JSON schema allows, in words."""
    if "$ref" in field:
        return allowed(definitions[field["$ref"].split("/")[-1]], definitions)
    if "anyOf" in field:
        return " or ".join(allowed(part, definitions) for part in field["anyOf"])
    if "const" in field:
        return f"`{field['const']}`"
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    kind = field.get("type", "")
    if kind == "array":
        text = f"list of {allowed(field['items'], definitions)}"
        return text + (f", {field['minItems']} or more" if "minItems" in field else "")
    if kind == "object" and isinstance(field.get("additionalProperties"), dict):
        return f"mapping of names to {allowed(field['additionalProperties'], definitions)}"
    words = {"number": "number", "integer": "whole number", "string": "text", "null": "null"}
    return words.get(kind, "mapping") + bounds(field)


def bounds(field):
    """' above 0, at most 1' of a JSON schema of a number; a pattern of a text."""
    names = {
        "exclusiveMinimum": "above",
        "minimum": "at least",
        "exclusiveMaximum": "below",
        "maximum": "at most",
    }
    found = [f"{word} {field[name]}" for name, word in names.items() if name in field]
    if "pattern" in field:
        found.append(f"matching `{field['pattern']}`")
    return " " + ", ".join(found) if found else ""


def default_of(key, part):
    """A schema's default as YAML would have it; 'needed' where there is none."""
    if key in part.get("required", ()):
        return "needed"
    value = part["properties"][key].get("default")
    if value in ({}, []) or value is None:
        return {"{}": "empty", "[]": "empty", "None": "none"}[str(value)]
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


def is_section(field, definitions):
    """The definition of a nested mapping with keys of its own, or None."""
    parts = field.get("anyOf", (field,))  # a section that may be left out is one of two
    name = next((part["$ref"] for part in parts if "$ref" in part), "").split("/")[-1]
    found = definitions.get(name, {})
    return found if "properties" in found else None


def values_of(field):
    """Schema of a mapping's values; empty where the keys are of any kind or it is no mapping."""
    values = field.get("additionalProperties")
    return values if isinstance(values, dict) else {}


def rows(part, definitions, prefix=""):
    """Table rows of a schema's keys, nested ones with their dotted path."""
    text = ""
    for key, field in part["properties"].items():
        section = is_section(field, definitions)
        if section:
            text += rows(section, definitions, f"{prefix}{key}.")
            continue
        items = is_section(field.get("items", {}), definitions)
        named = is_section(values_of(field), definitions)
        meaning = field.get("description", "").replace("|", "\\|")
        listed = "list of mappings, keys below" if items else None
        listed = "mapping of names to mappings, keys below" if named else listed
        what = listed or allowed(field, definitions)
        cells = (f"`{prefix}{key}`", unit_of(key) or "", default_of(key, part), what, meaning)
        text += f"| {' | '.join(cells)} |\n"
        if items:
            text += rows(items, definitions, f"{prefix}{key}.N.")
        if named:
            text += rows(named, definitions, f"{prefix}{key}.NAME.")
    return text


def configuration():
    """The page of a study's configuration."""
    schema = Config.model_json_schema()
    text = "# Configuration of a study\n\n"
    text += (
        "The keys of `config/config.yaml` and of files like it. [Configuration and "
        "stages](../configuration.md) has those that matter most. An error names the file, the "
        "key, the value and what is allowed.\n\n"
    )
    text += HEADER + rows(schema, schema["$defs"])
    text += (
        "\n`N` counts a list's entries from 0, `NAME` is a name of yours. `run` and the `run` of a "
        "bench test have the keys of a [run spec](run_spec.md), without `experiment` and "
        "`seed`.\n\n## Metrics\n\n"
        "What `calibrate.to` can be depends on the test's experiment:\n\n| experiment | metrics |\n"
        "|---|---|\n"
    )
    for experiment, names in METRICS.items():
        text += f"| `{experiment}` | {', '.join(f'`{n}`' for n in names)} |\n"
    text += (
        "\n## Factor table\n\nA tab-separated table, one factor a row, without lines that begin "
    )
    text += "with `#`: "
    return text + ", ".join(f"`{c}`" for c in COLUMNS) + ". The description may be missing.\n"


def run_spec():
    """The page of a run spec."""
    schema = RunSpec.model_json_schema()
    definitions = schema["$defs"]
    text = "# Run spec\n\n"
    text += (
        "Everything that determines one run. `dem init --experiment heap` writes it as a commented "
        "file. Defaults that depend on the experiment are those of the heap.\n\n"
    )
    shared = {k: v for k, v in schema["properties"].items() if k != "geometry"}
    text += HEADER + rows(schema | {"properties": shared}, definitions)
    for experiment, model in GEOMETRY.items():
        part = model.model_json_schema()
        text += f"\n## Geometry: {experiment}\n\n" + HEADER
        text += rows(part, part.get("$defs", {}), "geometry.")
        text += "\n" + metrics_of(experiments()[experiment])
    text += "\n## Which law needs what\n\n| law | needs | may take |\n|---|---|---|\n"
    for law in sorted(filter(keys_of, every_law()), key=lambda law: not groups_needed(law)):
        needs = " and ".join(" or ".join(f"`{n}`" for n in group) for group in groups_needed(law))
        more = ", ".join(f"`{n}`" for n in keys_allowed(law))
        text += f"| `{law.slot}: {law.name}` | {needs} | {more} |\n"
    return text


def metrics_of(experiment):
    """Table of an experiment's metrics."""
    text = "| metric | unit | meaning | a study's target |\n|---|---|---|---|\n"
    for m in experiment.metrics:
        target = "yes" if m.target else "no"
        text += f"| `{m.name}` | {unit_of(m.name) or ''} | {m.meaning} | {target} |\n"
    return text


def experiment_page(name):
    """The page of an experiment, of what its file declares."""
    e, part = experiments()[name], GEOMETRY[name].model_json_schema()
    text = f"# {e.title}\n\n`experiment: {name}`\n\n{inspect.getdoc(inspect.getmodule(e.run))}\n\n"
    text += "## What is set\n\n" + HEADER + rows(part, part.get("$defs", {}), "geometry.")
    text += "\n## What a run gives\n\n" + metrics_of(e)
    text += "\n## In the laboratory\n\n"
    if e.quantity:
        text += f"A table of measurements has `{e.quantity.name}` [{e.quantity.unit}] of `{name}`, "
        text += "and what was set:\n\n| column | unit | meaning |\n|---|---|---|\n"
        for column, lever in e.levers.items():
            text += f"| `{column}` | {lever.unit} | {lever.words} |\n"
    if e.mechanisms:
        shown = ", ".join(f"`{m}`" for m in e.mechanisms)
        text += (
            f"\nMechanisms of the diagnosis that show on it, beside those that name it: {shown}.\n"
        )
    text += f"\n```bash\ndem init --experiment {name} --out {name}.yaml\n"
    text += f"dem run {name}.yaml --out run\n```\n"
    return text


def experiments_page():
    """The list of the experiments."""
    text = "# Experiments\n\n| experiment | page |\n|---|---|\n"
    for name, e in experiments().items():
        text += f"| `{name}` | [{e.title}](experiment_{name}.md) |\n"
    return text


def command():
    """The page of the `dem` command: its own help, and that of each of its commands."""
    text = "# The dem command\n\n"
    for arguments in ([], *([name] for name in commands_of(help_of([])))):
        text += f"## dem {' '.join(arguments)}".rstrip() + "\n\n```text\n" + help_of(arguments)
        text += "```\n\n"
    return text.rstrip() + "\n"


def commands_of(text):
    """Names of the commands that a help text lists, four blanks from the left."""
    return re.findall(r"^ {4}(\w[\w-]*)(?: |$)", text, re.M)


def help_of(arguments):
    """Help text of a subcommand, 80 columns wide whatever the terminal."""
    stream, columns = io.StringIO(), os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "80"
    try:
        with contextlib.redirect_stdout(stream), contextlib.suppress(SystemExit):
            dem([*arguments, "--help"])
    finally:
        if columns is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = columns
    return stream.getvalue()


def verdict():
    """The page of the diagnosis' output, from its schema."""
    schema = json.loads((ROOT / "src/diagnosis/verdict.schema.json").read_text("utf-8"))
    text = "# verdict.json\n\n`results/<name>/diagnosis/verdict.json` holds what a "
    text += "[diagnosis](../diagnosis.md) found. Scores are in nats.\n\n"
    return text + "| key | content |\n|---|---|\n" + verdict_rows(schema)


def verdict_rows(part, prefix=""):
    """Table rows of the keys of a JSON schema, nested ones with their dotted path."""
    text = ""
    for key, field in part.get("properties", {}).items():
        words = field.get("description", "") or ", ".join(f"`{v}`" for v in field.get("enum", ()))
        text += f"| `{prefix}{key}` | {words.replace('|', chr(92) + '|')} |\n"
        text += verdict_rows(field, f"{prefix}{key}.")
        text += verdict_rows(field.get("items", {}), f"{prefix}{key}.N.")
        text += verdict_rows(values_of(field), f"{prefix}{key}.NAME.")
    return text


def starts_code():
    """The page of what may start code that is not this project's own."""
    text = "# What may start code\n\n"
    text += "[How to allow it](../configuration.md#what-may-start-code).\n\n"
    text += "A configuration starts nothing. snakemake reads it by YTE, which runs Python in a "
    text += "file that asks for it (`__use_yte__`), before any rule or script of the project "
    text += "begins. Only what a profile defines runs earlier. So the project's profiles put a "
    text += "reader of plain data in the place of YTE's; a check in the workflow is too late.\n\n"
    text += "| what | what is run | who allows it |\n|---|---|---|\n"
    with open(ROOT / "docs/starts_code.csv", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    return text + "".join(f"| `{r['name']}` | {r['runs']} | {r['allowed_by']} |\n" for r in rows)


def atlas():
    """The page of the atlas' tests: the ranges of their inputs, and why."""
    text = "# The atlas\n\n[What it is for](../atlas.md).\n"
    shared = {"every test": GRAIN}
    for title, inputs in (shared | {r.title: r.inputs for r in RIGS.values()}).items():
        text += f"\n## Inputs of {title}\n\n| input | from | to | reason |\n|---|---|---|---|\n"
        text += "".join(f"| {i.meaning} | {i.low:g} | {i.high:g} | {i.reason} |\n" for i in inputs)
    text += atlas_left_out() + atlas_laboratories() + atlas_published()
    return text + "".join(atlas_study(name, *told) for name, told in STUDIES.items())


def assumed():
    """The page of what `dem new` takes where nobody told it, and of its limits."""
    text = (
        "# What dem new assumes\n\nIt takes these numbers where nobody told it others, and asks or "
    )
    text += "refuses from these limits on.\n\n"
    return text + rows_of(["name", "value", "reason"], [r.values() for _, r in TABLE.rows])


ATLAS = ROOT / "results/reference/atlas"


def rows_of(heads, rows):
    """Markdown of a table."""
    return "".join(f"| {' | '.join(row)} |\n" for row in (heads, ["---"] * len(heads), *rows))


def atlas_left_out():
    """What `benchmarks/atlas.py` keeps of runs that are left out."""
    heads = ["test", "reading", "runs", "without a value", "its median", "error, median"]
    heads += ["error over that of the process (sd)", "taken so many times wider, of dry grains"]
    heads += ["of grains that stick"]
    rows = [
        [r.test, label(without_unit(r.metric)), f"{r.runs}", f"{r.without_value}"]
        + [f"{r.median:.3g}", f"{r.error:.2g}", f"{r.pull:.2f}"]
        + [f"{r.dry:.2f}", f"{r.sticky:.2f}"]
        for r in pd.read_csv(ATLAS / "left_out.csv").itertuples()
    ]
    return f"""
## Runs that are left out

Planned runs of each test: {RUNS}.

{rows_of(heads, rows)}
Angles are in degrees, lengths in diameters of the grain, densities in its own. The last columns
are what runs ask for by which the process was not trained.
"""


def atlas_laboratories():
    """What it keeps of made-up laboratories."""
    heads, rows = ["laboratories", "of", "held", "ranges", "reading", "error, median", "mean"], []
    account = pd.read_csv(ATLAS / "account.csv")
    judged = account[account["kind"].isin(["single", "several"])]
    held = judged["held"].dropna().astype(bool)
    angles = judged["error"][judged["of"].astype(str).str.endswith("_deg")].abs()
    for kind, own in account.groupby("kind", sort=False):
        shares = [own[c].dropna().astype(bool) for c in ("held", "range_held")]
        first = [kind, f"{own['seed'].nunique()}"]
        first += [f"{of.sum()} of {len(of)}" for of in shares]
        for metric, of in own[own["error"].notna()].groupby("of"):
            error, pull = of["error"], (of["error"] / of["sd"]).std()
            told = [
                label(without_unit(metric)),
                f"{error.abs().median():.2g}",
                f"{error.mean():+.2g}",
            ]
            rows.append([*first, *told, f"{pull:.2f}"])
            first = [""] * len(first)
    planned = yaml.safe_load((ROOT / "benchmarks/atlas.yaml").read_text()).items()
    every = ", ".join(f"{kind} {own['count']}" for kind, own in planned)
    return f"""
## Made-up laboratories

Planned: {every}. Those below are judged by the present runs.

Judged are `single` and `several`: {100 * held.mean():.0f} % of their intervals hold the truth
(stated: 85 to 95 %), and the median error of an angle is {angles.median():.1f}° (stated: 1.5° at
most).

`held`: intervals of 90 % that hold the truth. `ranges`: those that `dem new` narrows, and hold it.
Readings: median error of the mean that is told at the true parameters, its mean, and its scatter
over the error that is stated.

{rows_of([*heads, "over stated"], rows)}"""


def atlas_published():
    """What it tells of published materials."""
    rows = [
        [r.material.replace("_", " "), label(without_unit(r.metric)), unit_of(r.metric)]
        + [f"{r.measured:.4g} ± {r.error:.2g}", f"{r.predicted:.4g} ± {r.sd:.2g}"]
        + ["yes" if r.met else "no"]
        for r in pd.read_csv(ATLAS / "published.csv").itertuples()
    ]
    return f"""
## Published materials

The studies in `examples/` that begin from published values; `met`: whether parameters within the
published ranges meet all readings of a material. Sand packs denser than spheres of one size, and
pellets stand steeper.

{rows_of(["material", "reading", "unit", "measured", "told", "met"], rows)}"""


STUDIES = {
    "salt-atlas": ("The salt that begins there", "config/atlas.yaml"),
    "pp-atlas": ("Pellets that begin there", "examples/pp/atlas.yaml"),
    "soybean-atlas": ("Soybeans, whose heap lies outside", "examples/soybean/atlas.yaml"),
}


def atlas_study(name, title, settings):
    """The answer of a study by the atlas: its tests, its parameters, what is wrong."""
    study = json.loads((ROOT / f"results/reference/{name}/answer.json").read_text())
    tests = []
    for t in study["tests"]:
        at = [f"{label(without_unit(k))} {v:g} {unit_of(k)}" for k, v in t["setting"].items()]
        values = [f"{t['measured']:.4g} ± {t['error']:.2g}"]
        values += [f"{t['predicted']:.4g} ± {t['predicted_sd']:.2g}", f"{t['runs']}", t["state"]]
        tests.append([f"{label(without_unit(t['metric']))} [{t['unit']}]", ", ".join(at), *values])
    parameters = [
        [p["name"], f"{p['value']:.3g}", "{:.3g} to {:.3g}".format(*p["interval_95"])]
        + ["yes" if p["bounded"] else "no"]
        for p in study["parameters"]
        if p["source"] == "calibrated"
    ]
    return f"""
## {title}

`{settings}`, engine `{study["engine"]}`, {study["runs"]["made"]} runs.
{study["wrong"]["sentence"]}

{rows_of(["test", "setting", "measured", "predicted", "runs", "state"], tests)}
{rows_of(["parameter", "value", "interval (95 %)", "bounded by the tests"], parameters)}"""


def packages():
    """The page of every name at the top of each package, with its docstring's first sentence."""
    from every_name import tables

    return f"# Every name\n\n{tables()}\n"


def verification(figures):
    """The page of the engine beside closed forms and publications, from what the tests recorded;
    figures: folder for those that are drawn from the record."""
    sys.path.insert(0, str(ROOT / "tests" / "verification"))
    try:
        import page
        import page_figures

        page_figures.FOLDER = figures
        return page.text()
    finally:
        sys.path.remove(str(ROOT / "tests" / "verification"))


PAGES = {
    "configuration.md": configuration,
    "run_spec.md": run_spec,
    "command.md": command,
    "experiments.md": experiments_page,
    "verdict.md": verdict,
    "atlas.md": atlas,
    "assumed.md": assumed,
    "starts-code.md": starts_code,
    "packages.md": packages,
}
PAGES |= {f"experiment_{name}.md": partial(experiment_page, name) for name in experiments()}


SOURCES = {
    "own-material.md": "config/README.md",
    "example-soybean.md": "examples/soybean/README.md",
    "changelog.md": "CHANGELOG.md",
}
"""Page of the site -> the file outside docs/ that it is; there is no second copy."""

KEPT = ("results/reference/", "benchmarks/", "examples/", "data/")
"""Folders outside docs/ of which the site has a copy of each file that a page links to."""

LINK = re.compile(r"(?<=\]\()([^)#\s]+)")


def on_files(files, config):
    """Add the pages, those that lie elsewhere, and the kept results that pages link to, to what
    lies in docs/ (called by mkdocs)."""
    docs = Path(config.docs_dir)
    sys.path.insert(0, str(docs))
    for name, make in PAGES.items():
        files.append(File.generated(config, f"reference/{name}", content=make()))
    drawn = Path(tempfile.mkdtemp())
    text = verification(drawn)
    files.append(File.generated(config, "reference/verification.md", content=text))
    for folder in (docs / "verification", drawn):
        for figure in sorted(folder.glob("*.svg")):
            where = f"reference/verification/{figure.name}"
            files.append(File.generated(config, where, abs_src_path=str(figure)))
    texts = {f"docs/{p.name}": p.read_text("utf-8") for p in sorted(docs.glob("*.md"))}
    for name, source in SOURCES.items():
        texts[source] = (docs.parent / source).read_text("utf-8")
        files.append(File.generated(config, name, content=for_the_site(texts[source], source)))
    linked = _linked(texts)
    for name in [n for n in linked if n.endswith(".md") and (ROOT / n).exists()]:
        linked |= _linked({name: (ROOT / name).read_text("utf-8")})
    for name in sorted(linked):
        if (ROOT / name).exists():  # where it does not, mkdocs says so at the link
            files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    return files


def _linked(texts):
    """Paths in the kept folders that these pages, {path in the repository: text}, link to."""
    every = {_resolved(link, place) for place, text in texts.items() for link in LINK.findall(text)}
    return {name for name in every if name.startswith(KEPT) and name not in SOURCES.values()}


def on_page_markdown(markdown, page, config, files):
    """Point a page's links out of docs/ at the site's own pages and copies (called by mkdocs)."""
    if "/" in page.file.src_uri or page.file.src_uri in SOURCES:
        return markdown
    return for_the_site(markdown, f"docs/{page.file.src_uri}")


def for_the_site(markdown, place):
    """Text of the file `place` (a path in the repository) with its links as the site has them."""
    return LINK.sub(lambda m: _on_the_site(m[1], place), markdown)


def _resolved(link, place):
    """Path in the repository of a relative link in the file `place`."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(place), link))


def _on_the_site(link, place):
    if ":" in link:
        return link
    path = _resolved(link, place)
    page = next((name for name, source in SOURCES.items() if source == path), None)
    if page or path.startswith(KEPT):
        return page or path
    return path.removeprefix("docs/") if path.startswith("docs/") else link
