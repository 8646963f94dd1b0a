"""Collects what a study's stages left and writes it as one self-contained page; parts without files are left out."""

from pathlib import Path

from jinja2 import Environment, PackageLoader

from calibration.figures import quantity_of
from calibration.report.answer import answer
from calibration.report.embed import download
from calibration.report.heaps import gallery, viewer
from calibration.report.parts import BESIDE, STAGES, beside, diagnosis, stage
from calibration.report.runs import runs_section

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
        viewer=viewer(study, quantity),
        parts=_parts(study, quantity),
        exports=_exports(study),
    )
    partial = out.with_name(f".{out.name}.partial")
    partial.write_text(page)
    partial.replace(out)


def _parts(study, quantity):
    """Sections in the order of reading: the diagnosis after the chain, what stands beside it last."""
    chain = [_with_heaps(study, key, quantity) for key in CHAIN]
    bench = [stage(study, key, quantity) for key in STAGES if key not in CHAIN]
    more = [beside(study, key) for key in BESIDE]
    return [p for p in (*chain, diagnosis(study), *bench, *more, runs_section(study)) if p]


def _with_heaps(study, key, quantity):
    """A stage with the pictures of its runs; the runs added at the optimum are the stage `candidate`."""
    part = stage(study, key, quantity)
    pictured = "candidate" if key == "optimise" else key
    return part and part | {"gallery": gallery(study, pictured, quantity)}


def _exports(study):
    """Files that carry the parameters elsewhere: their text for copying and their download."""
    files = [study / "calibrated.yaml", *sorted((study / "exports").glob("*"))]
    return [{"text": p.read_text(), **download(p), "file": p.name} for p in files if p.is_file()]
