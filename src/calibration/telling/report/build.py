"""Collects what a study's stages left and writes it as one self-contained page. A stage that has
not run is left out; of one that has, the page names what is missing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader

from calibration.figures import response_of
from calibration.files import write_text
from calibration.telling.report.answer import answer, findings
from calibration.telling.report.carried import citation, workbook
from calibration.telling.report.embed import download, downloads_of, packed
from calibration.telling.report.parts import section
from calibration.telling.report.profiler import profiler
from calibration.telling.report.runs import runs_section
from calibration.telling.report.sheet import sheet, viewer

if TYPE_CHECKING:
    from calibration.study.stage import Stage


EVERY = "Every parameter with its unit, source and interval"
CARRIED = {
    "edem.md": "EDEM: the model to type in, in the Creator's order",
    "rocky.md": "Rocky: the model to type in",
    "liggghts.in": "LIGGGHTS: commands to include",
    "lammps.in": "LAMMPS: commands to include",
    "yade.py": "YADE: a script to execute",
    "mercurydpm.cpp": "MercuryDPM: lines for a driver code",
    "dem.yaml": "This engine: a heap at the calibrated point",
    "study.yaml": "This workflow: the whole study's configuration",
}
"""File of exports/ -> what it is for."""
NOT_CONVERTED_MARK = "NOT CONVERTED: rolling friction"
NOT_CONVERTED = (
    "LIGGGHTS, LAMMPS, YADE and MercuryDPM have other laws of rolling friction than the one "
    "calibrated with: the same "
    "number gives a flatter heap there. Their blocks say so at their head; calibration run STUDY "
    "export_converted searches the "
    "numbers that give the calibrated angle and puts them here."
)


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
    environment = Environment(
        loader=PackageLoader("calibration.telling.report", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    parts, exports = _parts(study, stages, response), _exports(study)
    said, found = answer(study, response), findings(study, response)
    carry = [packed(f"{study.name}.xlsx", workbook(study.name, said, found))] if said else []
    page = environment.get_template("page.html.j2").render(
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
        files=json.dumps(downloads_of(carry, parts, exports)),
    )
    write_text(page, out)
    absent = [] if said else [f"{study / 'answer'}: answer.json missing; the page is without"]
    return absent + [
        f"{study / part['key']}: {', '.join(part['missing'])} missing; the page is without"
        for part in parts
        if part.get("missing")
    ]


def _parts(study, stages, response):
    """Sections in the order of reading, the runs last."""
    parts = [section(study, stage, response) for stage in stages.values()]
    return [p for p in (*parts, runs_section(study, stages)) if p]


def _exports(study):
    """Files that carry the parameters elsewhere, or None: what to know of them, and of each what it
    is, its text for copying and its download. A block with converted rolling friction takes the
    place of the one without."""
    folder = study / "exports"
    named = {study / "calibrated.yaml": EVERY}
    for name, text in CARRIED.items():
        converted = folder / "converted" / name
        named[converted if converted.is_file() else folder / name] = text
    files = [
        {
            **download(p),
            "file": p.name,
            "path": p.relative_to(study),
            "about": text,
            "text": p.read_text(),
        }
        for p, text in named.items()
        if p.is_file()
    ]
    note = NOT_CONVERTED if any(NOT_CONVERTED_MARK in f["text"] for f in files) else ""
    return {"note": note, "files": files} if files else None
