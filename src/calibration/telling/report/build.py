"""Collects what a study's stages left and writes it as one self-contained page. A stage that has
not run is left out; of one that has, the page names what is missing. At its end: which runs the
study is made of, their number, seeds, size and time."""

import json
import math
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.chain.study import Results
from calibration.figures import WORDS, Response, label, response_of
from calibration.files import csv_text, write_text
from calibration.intake.tables import read_written
from calibration.runs.store import RunStore
from calibration.study.stage import Stage
from calibration.telling.answer.words import said
from calibration.telling.report import embed
from calibration.telling.report.answer import answer, citation, findings, profiler, workbook
from calibration.telling.report.sheet import sheet, viewer
from calibration.telling.sentences import sentences_of
from dem.errors import ResultError

NOT_CONVERTED_MARK = "NOT CONVERTED: rolling friction"


def build(
    study: str | Path,
    out: str | Path,
    stages: Mapping[str, Stage],
    metric: str = "angle_of_repose_deg",
) -> list[str]:
    """Write the report of `study` (a folder under results/) to `out`, atomically. Returns a
    sentence for each stage that lacks files which it declares.

    stages: {name: Stage} in the order of the page; metric: what was calibrated.
    """
    study, out = Path(study), Path(out)
    response = response_of(metric)
    parts = [section(study, stage, response) for stage in stages.values()]
    parts = [part for part in (*parts, runs_section(study, stages)) if part]
    exports = _exports(study)
    said, found = answer(study, response), findings(study, response)
    carry = [embed.packed(f"{study.name}.xlsx", workbook(study.name, said, found))] if said else []
    page = embed.filled(
        "page.html.j2",
        name=study.name,
        answer=said,
        findings=found,
        carried=carry,
        citation=citation(study.name),
        profiler=profiler(study, response),
        viewer=viewer(study, response),
        sheet=sheet(study, stages, response, metric),
        parts=parts,
        exports=exports,
        files=json.dumps(embed.downloads_of(carry, parts, exports)),
    )
    write_text(page, out)
    absent = [] if said else [f"{study / 'answer'}: answer.json missing; the page is without"]
    return absent + [
        f"{study / part['key']}: {', '.join(part['missing'])} missing; the page is without"
        for part in parts
        if part.get("missing")
    ]


def _exports(study):
    """Files that carry the parameters elsewhere, or None: `unlike`, whether the rolling friction of
    any is not converted, and of each what it is, its text for copying and its download. A block
    with converted rolling friction takes the place of the one without."""
    folder = study / "exports"
    named = {}
    for name, text in WORDS["file"].items():
        places = study / name, folder / "converted" / name, folder / name
        named[next((place for place in places if place.is_file()), folder / name)] = text
    files = [
        embed.download(p)
        | {"file": p.name, "path": p.relative_to(study), "about": text, "text": p.read_text()}
        for p, text in named.items()
        if p.is_file()
    ]
    unlike = any(NOT_CONVERTED_MARK in f["text"] for f in files)
    return {"unlike": unlike, "files": files} if files else None


ALL_ROWS = 10_000  # a table of verdicts is shown whole, in a box that scrolls


def section(study: Path, stage: Stage, response: Response) -> dict[str, Any] | None:
    """The section of a declared stage in the folder of a study, or None where it has not run or has
    none. Of one that has run, it names the declared files that are missing."""
    folder = study / stage.name
    declared = [f"{name}.csv" for name, _ in stage.tables]
    for f in stage.figures:
        declared += [f"{f.name}.svg", *f.numbers]
    missing = [name for name in dict.fromkeys(declared) if not (folder / name).exists()]
    ran = len(missing) < len(set(declared))
    if stage.name == "diagnosis":
        made = diagnosis(study)
    elif not ran:
        return None
    else:
        tables = [(p, t) for name, t in stage.tables if (p := folder / f"{name}.csv").exists()]
        made = (_beside if stage.about else _listed)(study, stage, response, tables)
        made |= {"key": stage.name, "title": stage.title}
    return made and made | {"supplement": stage.supplement, "missing": missing if ran else []}


def _drawn(folder, stage, data_of):
    """The declared figures that are there, with the files data_of(`Figure`) of their numbers."""
    paths = [(p, f) for f in stage.figures if (p := folder / f"{f.name}.svg").exists()]
    return [embed.figure(p, _named(stage.name, p), data_of(f)) for p, f in paths]


def _listed(study, stage, response, tables):
    """The section of a stage that says its outcome in sentences."""
    folder = study / stage.name
    drawn = _drawn(folder, stage, lambda f: [folder / d for d in f.numbers])
    return {
        "texts": sentences_of(stage, Results(study).summary(stage.name), response),
        "figures": drawn,
        "tables": [embed.table(path, title) for path, title in tables],
    }


def _beside(study, stage, _, tables):
    """The section of what stands beside the chain, made of its tables, figures and summary."""
    folder = study / stage.name
    paths, summary = [p for p, _ in tables], [*folder.glob(f"{stage.name}.json")]
    figures = _drawn(folder, stage, lambda _: [*paths, *summary])
    return {
        "texts": [stage.about, *_counts(paths)],
        "figures": figures,
        "tables": [
            embed.table(p, title, ("verdict", "disagrees"), ALL_ROWS, stage.unshown)
            | {"open": True}
            for p, title in tables
        ],
        "downloads": [] if figures else [embed.download(p) for p in summary],
    }


def _counts(tables):
    """How many rows of a table of verdicts have which: 1 agrees, 2 agree."""
    for frame in map(read_written, tables):
        for column in (c for c in ("verdict", "agreement") if c in frame):
            found = frame[column].value_counts().rename(lambda word: label(str(word)))
            told = [
                f"{n} {re.sub('agrees$', 'agree' + 's' * (n == 1), w)}" for w, n in found.items()
            ]
            yield f"{len(frame)} in all: {', '.join(told)}."


def _named(key, path):
    """Caption of a figure: the file of workflow/report that bears the stage's name and its own, or
    its own, or its name in plain words."""
    return (
        embed.caption(f"{key}_{path.stem}")
        or embed.caption(path.stem)
        or label(path.stem).capitalize()
    )


def diagnosis(study: Path) -> dict[str, Any] | None:
    """The section of the diagnosis, or None."""
    folder = study / "diagnosis"
    verdict = Results(study).summary("diagnosis", "verdict")
    if not verdict:
        return None
    figures = [
        embed.figure(p, _named("diagnosis", p), [folder / "verdict.json"])
        for p in sorted(folder.glob("*.svg"))
    ]
    return {
        "key": "diagnosis",
        "title": "What the calibrated model gets wrong",
        "texts": said("whole_diagnosis", verdict),
        "figures": figures,
        "tables": [
            embed.table(p, label(p.stem).capitalize()) for p in sorted(folder.glob("*.csv"))
        ],
        "downloads": [embed.download(folder / "verdict.json")],
    }


MEASURES = ("steps", "simulated_time_s", "wall_time_s")
"""Of a run's numerics; one without a value has none."""


def runs_section(study: Path, stages: Mapping[str, Stage]) -> dict[str, Any] | None:
    """The section of run times and seeds, or None where no run is at hand."""
    found, store = [], RunStore()
    for plan in (plan for stage in stages.values() for plan in stage.plans):
        design = study / plan.folder / "design.csv"
        for name in read_written(design)["run_id"] if design.exists() else []:
            with suppress(ResultError):  # the study was moved here without all of its runs
                found.append((plan.folder, name, store.result(name)))
    if not found:
        return None
    runs = pd.DataFrame(
        {"stage": stage, "run_id": name, "seed": result["seed"]}
        | {"particles": result["spec"]["particles"]["count"]}
        | {key: result["numerics"].get(key, math.nan) for key in MEASURES}
        | {"engine": result["engine"]}
        for stage, name, result in found
    )
    rows = [
        {
            "stage": label(stage),
            "runs": len(own),
            "seeds": _span(own["seed"]),
            "particles": _span(own["particles"]),
            "steps per run": int(own["steps"].mean()) if own["steps"].notna().all() else "",
            "time per run [s]": f"{own['wall_time_s'].mean():.3g}",
            "together [min]": f"{own['wall_time_s'].sum() / 60.0:.2g}",
        }
        for stage, own in runs.groupby("stage", sort=False)
    ]
    timed = runs.dropna(subset="wall_time_s").drop_duplicates("run_id")
    total = timed["wall_time_s"].sum() / 60.0
    engines = ", ".join(sorted(runs["engine"].unique()))
    return {
        "key": "runs",
        "title": "Runs, times and seeds",
        "texts": [
            f"{timed['run_id'].nunique()} runs took {total:.1f} minutes of one core, by engine "
            f"{engines}. A run that two stages share was made once.",
        ],
        "figures": [],
        "tables": [
            {
                "title": "Runs by stage",
                "html": embed.html_of(pd.DataFrame(rows)),
                "rows": len(rows),
                "shown": len(rows),
                "open": True,
                "download": embed.packed("runs.csv", csv_text(runs).encode()),
            }
        ],
    }


def _span(values):
    low, high = values.min(), values.max()
    return f"{low}" if low == high else f"{low} to {high}"
