"""Collects what a study's stages left and writes it as one self-contained page; parts without files are left out."""

from pathlib import Path

from jinja2 import Environment, PackageLoader

from calibration.figures import quantity_of
from calibration.files import replacing
from calibration.report.answer import answer
from calibration.report.block import block
from calibration.report.embed import download
from calibration.report.findings import findings
from calibration.report.heaps import gallery, viewer
from calibration.report.parts import BESIDE, STAGES, beside, diagnosis, stage
from calibration.report.profiler import profiler
from calibration.report.runs import runs_section

CARRIED = {
    "edem.md": "EDEM: a table to type in",
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
    "LIGGGHTS, LAMMPS, YADE and MercuryDPM have other laws of rolling friction than the one calibrated with: the same "
    "number gives a flatter heap there. Their blocks say so at their head; snakemake -j2 export_converted searches the "
    "numbers that give the calibrated angle and puts them here."
)
CHAIN = ("screening", "ascent", "response_surface", "optimise", "validation")


def build(study, out, metric="angle_of_repose_deg"):
    """Write the report of `study` (a folder under results/) to `out`, atomically; metric: what was calibrated."""
    study, out = Path(study), Path(out)
    quantity = quantity_of(metric)
    environment = Environment(
        loader=PackageLoader("calibration.report", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("page.html.j2").render(
        name=study.name,
        answer=answer(study, quantity),
        block=block(study),
        findings=findings(study, quantity),
        profiler=profiler(study, quantity),
        viewer=viewer(study, quantity),
        parts=_parts(study, quantity, metric),
        exports=_exports(study),
    )
    with replacing(out) as partial:
        partial.write_text(page)


def _parts(study, quantity, metric):
    """Sections in the order of reading: the diagnosis after the chain, what stands beside it last."""
    chain = [_with_heaps(study, key, quantity, metric) for key in CHAIN]
    bench = [stage(study, key, quantity) for key in STAGES if key not in CHAIN]
    more = [beside(study, key) for key in BESIDE]
    return [p for p in (*chain, diagnosis(study), *bench, *more, runs_section(study)) if p]


def _with_heaps(study, key, quantity, metric):
    """A stage with the pictures of its runs; the runs added at the optimum are the stage `candidate`."""
    part = stage(study, key, quantity)
    pictured = "candidate" if key == "optimise" else key
    return part and part | {"gallery": gallery(study, pictured, quantity, metric)}


def _exports(study):
    """Files that carry the parameters elsewhere, or None: what to know of them, and of each what it is, its text for
    copying and its download. A block with converted rolling friction takes the place of the one without."""
    folder = study / "exports"
    named = {study / "calibrated.yaml": "Every parameter with its unit, source and interval"}
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
