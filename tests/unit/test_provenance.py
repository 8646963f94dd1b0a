"""A study that is handed on: what its RO-Crate says, by the specification's own words, and its runs
in one file."""

import json
import sys

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration.chain.jobs import study_of, work_for
from calibration.errors import CalibrationError
from calibration.runs.all_runs import finished, runs_table
from calibration.runs.plans import write_plan
from calibration.runs.simulated import simulate
from calibration.stages.provenance import metadata, provenance
from facts import refused
from stage_files import Files
from workflow.deployed import write_study

LEVELS = pd.DataFrame({"bounce": [0.4, 0.5, 0.6, 0.5], "run": [1, 2, 3, 4]})


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Four drops that a formula answers, and one that was planned and not made."""
    folder = tmp_path_factory.mktemp("outer")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        config = write_study(folder / "bounce")
        study = work_for(yaml.safe_load(config.read_text()))
        table, specs = study.plan(LEVELS)
        simulate(specs)
        later, unmade = study.plan(LEVELS[:1].assign(bounce=0.45))
        write_plan(study.folder / "screening" / "plan.json", table, specs)
        write_plan(study.folder / "validation" / "plan.json", later, specs | unmade)
        (study.folder / "exports").mkdir()
        (study.folder / "exports" / "study.yaml").write_text(config.read_text())
        (study.folder / "report.html").write_text("<p>All of it.</p>")
        yield study


@pytest.fixture(scope="module")
def crate(study):
    """The crate's folder and its metadata."""
    folder = study.folder.resolve() / "provenance"
    output = Files(crate=str(folder / "ro-crate-metadata.json"), runs=str(folder / "runs.csv"))
    shown = [p for p in sorted(study.folder.rglob("*")) if p.is_file()]
    report = study.folder / "report.html"
    provenance(study, Files(report=report, shown=shown, also=[]), output)
    return folder, json.loads((folder / "ro-crate-metadata.json").read_text())


def entities(metadata):
    return {entity["@id"]: entity for entity in metadata["@graph"]}


def test_the_descriptor_and_the_root_are_as_ro_crate_1_1_asks(crate):
    """Sections "RO-Crate Metadata File Descriptor" and "Root Data Entity" of the specification."""
    _, metadata = crate
    assert metadata["@context"] == "https://w3id.org/ro/crate/1.1/context"
    graph = entities(metadata)
    assert len(graph) == len(metadata["@graph"])
    descriptor, root = graph["ro-crate-metadata.json"], graph["./"]
    assert descriptor["@type"] == "CreativeWork"
    assert descriptor["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.1"}
    assert descriptor["about"] == {"@id": "./"}
    assert root["@type"] == "Dataset"
    assert pd.Timestamp(root["datePublished"])
    assert root["name"] == "Calibration drops"
    assert "rebound_height_mm" in root["description"]
    assert graph[root["license"]["@id"]]["name"] == "no licence stated"


def references(value):
    """Identifiers that a value refers to."""
    if isinstance(value, list):
        return {i for part in value for i in references(part)}
    return {value["@id"]} if isinstance(value, dict) else set()


def test_every_file_is_there_and_every_reference_has_its_entity(crate):
    folder, metadata = crate
    graph = entities(metadata)
    files = {i: e for i, e in graph.items() if e["@type"] == "File"}
    assert references(graph["./"]["hasPart"]) == set(files)
    for place, entity in files.items():
        assert int(entity["contentSize"]) == (folder / place).stat().st_size
        assert "/" in entity["encodingFormat"]
    there = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    assert there == {*files, "ro-crate-metadata.json"}
    assert {"inputs/factors.tsv", "inputs/measured.csv", "inputs/study.yaml"} <= set(files)
    assert {"runs.csv", "results/report.html", "results/screening/design.csv"} <= set(files)
    for entity in metadata["@graph"]:
        for key, value in entity.items():
            outside = {i for i in references(value) - set(graph) if not i.startswith("http")}
            assert not outside, key


def test_it_says_what_made_which_from_what(crate):
    graph = entities(crate[1])
    action = graph["#study"]
    assert action["@type"] == "CreateAction"
    programs = {graph[i]["name"]: graph[i] for i in references(action["instrument"])}
    assert {"granular-calibration", "command", "numba"} <= set(programs)
    assert programs["command"]["softwareVersion"] == "1"
    assert programs["python"]["softwareVersion"] == ".".join(map(str, sys.version_info[:3]))
    assert "inputs/measured.csv" in references(action["object"])
    assert "results/report.html" in references(action["result"])


def test_its_configuration_reads_its_own_tables(crate, monkeypatch):
    monkeypatch.chdir(crate[0])
    data = yaml.safe_load((crate[0] / "inputs" / "study.yaml").read_text())
    assert data["factors"] == "inputs/factors.tsv"
    assert study_of(data).factors[0].name == "bounce"


def test_another_program_reads_it(crate):
    rocrate = pytest.importorskip("rocrate.rocrate")
    read = rocrate.ROCrate(crate[0])
    assert read.name == "Calibration drops"
    assert read.version == "1.1"


def test_all_runs_are_in_one_table(study):
    table = runs_table(study, finished(study.folder))
    assert list(table["stages"]) == ["screening validation"] * 4
    key = "contacts.particle_wall.restitution"
    assert sorted(table[key]) == [0.4, 0.5, 0.5, 0.6]
    height = 5.0 * table[key] ** 2 + 0.02 * (table["seed"] % 2)
    np.testing.assert_allclose(table["rebound_height_mm"], height, rtol=1e-12)


def test_a_missing_package_is_named_with_its_extra(monkeypatch):
    for name in ("rocrate", "rocrate.model", "rocrate.model.contextentity"):
        monkeypatch.setitem(sys.modules, name, None)
    with refused(CalibrationError, "granular-calibration[provenance]"):
        metadata(None, None, (), (), {})
