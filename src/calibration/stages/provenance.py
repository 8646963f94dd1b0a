"""The stage `provenance`: a study as an RO-Crate, with what it read, what came out, what computed
it, and all of its runs in one file.

RO-Crate 1.1 (Sefton et al. 2021, https://doi.org/10.5281/zenodo.5146227): a folder with
ro-crate-metadata.json, which describes the files beside it in schema.org's words.
"""

import mimetypes
import shutil
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from calibration.chain.handed_over import NamedFiles
from calibration.chain.study import Study, each_file
from calibration.errors import CalibrationError
from calibration.files import write_table, write_text
from calibration.runs.all_runs import CRATE, finished, runs_table
from calibration.study.stage import Stage
from calibration.telling.export.parameters import to_yaml
from calibration.telling.report.carried import PACKAGE, program
from dem.io.files import replace_file, write_json

SHOWN = (".csv", ".json", ".html", ".yaml")
"""Kinds of results that the crate holds; figures are in the report."""
CONFIGURATION, STUDY = "exports/study.yaml", "inputs/study.yaml"
"""The whole configuration as the study exports it, and in the crate, where it names the crate's own
tables."""
UNSTATED = {
    "@type": "CreativeWork",
    "name": "no licence stated",
    "description": "Who publishes this study chooses its licence.",
}


def provenance(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write the crate into the folder of `output.crate`, its metadata last. Raises CalibrationError
    for a study without a finished run."""
    folder = Path(output.crate).parent
    made = each_file(Path(p).resolve() for p in (source.report, *source.shown, *source.also))
    runs = finished(study.folder, [path for path in made if path.name == "plan.json"])
    if not runs:
        raise CalibrationError(f"{study.folder}: has no finished run")
    write_table(runs_table(study, runs), output.runs)
    given = {key: Path(getattr(study.config, key)) for key in ("factors", "measurements")}
    tables = {key: f"inputs/{path.name}" for key, path in given.items()}
    copied = {tables[key]: path for key, path in given.items()}
    top = study.folder.resolve()
    kept = sorted(path for path in made if path.suffix in SHOWN)
    results = {f"results/{path.relative_to(top).as_posix()}": path for path in kept}
    for place, path in (copied | results).items():
        with open(path, "rb") as kept:
            replace_file(folder / place, partial(shutil.copyfileobj, kept))
    configuration = yaml.safe_load((study.folder / CONFIGURATION).read_text("utf-8"))
    write_text(to_yaml(configuration | tables), folder / STUDY)
    files = [STUDY, *copied], [*results, Path(output.runs).name]
    write_json(output.crate, metadata(study, folder, *files, _software(runs)))


def metadata(
    study: Study,
    folder: Path,
    inputs: Sequence[str],
    results: Sequence[str],
    software: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """Content of ro-crate-metadata.json. inputs, results: files of the crate's folder; software:
    {identifier: properties} of the programs."""
    try:
        from rocrate.model.contextentity import ContextEntity
        from rocrate.rocrate import ROCrate
    except ModuleNotFoundError as error:
        raise CalibrationError(
            f"The stage provenance needs the package {error.name}, which a plain install leaves "
            f"out: pip install '{PACKAGE}[provenance]'"
        ) from None
    today = datetime.now(UTC).date().isoformat()
    crate = ROCrate(version="1.1")
    crate.name = f"Calibration {study.name}"
    crate.description = (
        f"Calibration of a discrete element model on {study.config.target.metric}: the tables it "
        f"was made from, its results and its runs, by {program()}."
    )
    crate.datePublished = today
    crate.license = crate.add(ContextEntity(crate, "#licence", properties=UNSTATED))

    def files(places):
        return [crate.add_file(dest_path=p, properties=_described(folder / p, p)) for p in places]

    programs = [crate.add(ContextEntity(crate, k, properties=p)) for k, p in software.items()]
    crate.add_action(
        programs,
        identifier="#study",
        object=files(inputs),
        result=files(results),
        properties={
            "name": "the study's runs and analyses",
            "endTime": today,
            "actionStatus": "http://schema.org/CompletedActionStatus",
        },
    )
    return crate.metadata.generate()


def _described(path, place):
    """Properties of a file."""
    kind = {".yaml": "application/yaml"}.get(path.suffix)
    return {
        "name": place,
        "encodingFormat": kind or mimetypes.guess_type(path.name)[0] or "text/plain",
        "contentSize": str(path.stat().st_size),
    }


def _software(runs):
    """{identifier: properties} of the programs that `finished` runs were made with, by their
    manifests."""
    found = {}

    def add(name, version):
        properties = {"@type": "SoftwareApplication", "name": name, "softwareVersion": version}
        found[f"#{name}-{version}".replace(" ", "-")] = properties

    add(*program().split())
    for _, _, result in runs:
        other = result["spec"].get("engine")
        if other:
            add(other["name"], str(other["identity"].get("version", "not stated")))
        else:
            add("dem", result["engine"])
        for name, version in result["manifest"]["software"].items():
            if name != "cpu":
                add(name, version)
    return found


STAGES = (Stage(name=CRATE, title="Provenance", place=9.9),)
