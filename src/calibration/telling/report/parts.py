"""The stages as sections of the page: their outcome in words, figures, tables and data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calibration.chain.study import Results
from calibration.figures import label, response_of
from calibration.intake.tables import read_written
from calibration.telling.answer.words import said
from calibration.telling.kept_results import sentences_of
from calibration.telling.report.embed import caption, download, figure, table

if TYPE_CHECKING:
    from pathlib import Path

    from calibration.figures import Response
    from calibration.study.stage import Stage


FRONT = "front"  # of a further target; without one there is no such figure
ALL_ROWS = 10_000  # a table of verdicts is shown whole, in a box that scrolls


def section(study: Path, stage: Stage, response: Response) -> dict[str, Any] | None:
    """The section of a declared stage in the folder of a study, or None where it has not run or has
    none."""
    missing = _missing(study, stage)
    if stage.name == "diagnosis":
        made = diagnosis(study)
    elif missing is None:
        return None
    else:
        made = beside(study, stage) if stage.about else _listed(study, stage, response)
    return made and made | {"supplement": stage.supplement, "missing": missing}


def _missing(study, stage):
    """Names of the declared files that a stage's folder lacks; None where it has none of them."""
    names = [f"{name}.csv" for name, _ in stage.tables]
    for drawn in stage.figures:
        names += [f"{drawn.name}.svg", *drawn.numbers]
    there = {name for name in names if (study / stage.name / name).exists()}
    return [name for name in dict.fromkeys(names) if name not in there] if there else None


def _listed(study, stage, response):
    """The section of a stage that says its outcome in sentences."""
    folder = study / stage.name
    drawn = [
        figure(path, _named(stage.name, path), [folder / d for d in f.numbers])
        for f in stage.figures
        if (path := folder / f"{f.name}.svg").exists()
    ]
    shown = [
        table(folder / f"{name}.csv", text)
        for name, text in stage.tables
        if (folder / f"{name}.csv").exists()
    ]
    drawn += _further(folder, [f.name for f in stage.figures])
    summary = Results(study).summary(stage.name)
    return {
        "key": stage.name,
        "title": stage.title,
        "texts": sentences_of(stage, summary, response),
        "figures": drawn,
        "tables": shown,
    }


def _further(folder, listed):
    """Figures of further targets, <figure>_<metric>.svg or <metric>.svg, with the files that bear
    the metric."""
    figures = []
    for path in sorted(p for p in folder.glob("*.svg") if p.stem not in listed):
        base = next((n for n in (*listed, FRONT) if path.stem.startswith(f"{n}_")), None)
        metric = path.stem.removeprefix(f"{base}_")
        text = f"{response_of(metric).name.capitalize()}: {caption(base or folder.name)}"
        data = sorted(p for p in folder.glob(f"*{metric}*") if p.suffix != ".svg")
        figures.append(figure(path, text, [*data, folder / "runs.csv"]))
    return figures


def beside(study: Path, stage: Stage) -> dict[str, Any]:
    """The section of what stands beside the chain, made of its tables, figures and summary."""
    key = stage.name
    folder = study / key
    figures = [p for f in stage.figures if (p := folder / f"{f.name}.svg").exists()]
    tables = [(p, t) for name, t in stage.tables if (p := folder / f"{name}.csv").exists()]
    paths, summary = [p for p, _ in tables], [*folder.glob(f"{key}.json")]
    return {
        "key": key,
        "title": stage.title,
        "texts": [stage.about, *_counts(paths)],
        "figures": [figure(p, _named(key, p), [*paths, *summary]) for p in figures],
        "tables": [_beside_table(p, title, stage.unshown) for p, title in tables],
        "downloads": [] if figures else [download(p) for p in summary],
    }


def _beside_table(path, title, unshown):
    first = ("verdict", "disagrees")
    return table(path, title, first, ALL_ROWS, unshown) | {"open": True}


def _counts(tables):
    """How many rows of a table of verdicts have which."""
    sentences = []
    for path in tables:
        frame = read_written(path)
        judged = [column for column in ("verdict", "agreement") if column in frame]
        for column in judged:
            found = frame[column].value_counts()
            words = ", ".join(f"{n} {_verb(label(str(word)), n)}" for word, n in found.items())
            sentences.append(f"{len(frame)} in all: {words}.")
    return sentences


def _verb(word, n):
    """A verdict behind its number: 1 agrees, 2 agree."""
    return word.removesuffix("s") if n != 1 and word.endswith("agrees") else word


def _named(key, path):
    """Caption of a figure: the file of workflow/report that bears the stage's name and its own, or
    its own, or its name in plain words."""
    return caption(f"{key}_{path.stem}") or caption(path.stem) or label(path.stem).capitalize()


def diagnosis(study: Path) -> dict[str, Any] | None:
    """The section of the diagnosis, or None."""
    folder = study / "diagnosis"
    verdict = Results(study).summary("diagnosis", "verdict")
    if not verdict:
        return None
    texts = said("diagnosis", verdict)
    texts += [p["sentence"] if isinstance(p, dict) else str(p) for p in verdict.get("patterns", [])]
    following = verdict.get("next_measurement")
    if following:
        levers = ", ".join(f"{label(k)} {v:.3g}" for k, v in following.get("levers", {}).items())
        texts.append(
            f"The measurement that would tell most next: {following['experiment']}, {levers}."
        )
    figures = [
        figure(p, _named("diagnosis", p), [folder / "verdict.json"])
        for p in sorted(folder.glob("*.svg"))
    ]
    return {
        "key": "diagnosis",
        "title": "What the calibrated model gets wrong",
        "texts": texts,
        "figures": figures,
        "tables": [table(p, label(p.stem).capitalize()) for p in sorted(folder.glob("*.csv"))],
        "downloads": [download(folder / "verdict.json")],
    }
