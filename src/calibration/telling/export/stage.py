"""The stage `export`: plans of its runs, and its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.chain.files import read_region
from calibration.chain.responses import with_value
from calibration.engines import lammps, liggghts, yade
from calibration.engines.conversion import Conversion, granulate, left_out
from calibration.files import read_json, write_text
from calibration.intake.tables import read_written
from calibration.runs.store import RunStore
from calibration.stages.optimum import augmented_runs
from calibration.stages.validation import handed_out
from calibration.statistics.surface import fit_surface
from calibration.telling.answer.schema import answer_of
from calibration.telling.answer.words import head
from calibration.telling.export import by_hand, mercurydpm
from calibration.telling.export.by_hand import Expected
from calibration.telling.export.decks import scatter_of_one, write_decks
from calibration.telling.export.heap_comparison import profile
from calibration.telling.export.joint import by_joint
from calibration.telling.export.parameters import (
    calibrated_entries,
    entries,
    fixed_entries,
    published_values,
    to_yaml,
)
from calibration.telling.export.rolling import (
    Evidence,
    calibrated_spec,
    conclude,
    plan_confirmation,
    plan_correction,
    plan_scan,
    read_scan,
)
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.render import read_run
from dem.render.image import plate_of
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of

if TYPE_CHECKING:
    import pandas as pd

    from calibration.chain.handed_over import NamedFiles
    from calibration.chain.study import Study
    from calibration.study.config import Config
    from calibration.study.factors import Factor
    from dem.spec import RunSpec


CONVERTED = {
    "liggghts.in": liggghts,
    "lammps.in": lammps,
    "yade.py": yade,
    "mercurydpm.cpp": mercurydpm,
}
"""File under exports/ -> module that writes it; these codes may need another rolling law than the
calibrated one."""
BY_HAND = {"edem.md": "edem", "rocky.md": "rocky"}
"""File -> program that is filled in by hand: pages, with interval and source."""
CODES = (*CONVERTED, *BY_HAND)


def _spec(study, source):
    return calibrated_spec(study.config, study.factors, handed_out(source))


def plan_export_scan(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the search for rolling friction in other laws."""
    plan_scan(_spec(study, source), output)


def plan_export_confirmation(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the runs that confirm what the search found."""
    scan = read_scan(source.scan, study.config.target.metric)
    plan_confirmation(_spec(study, source), scan, output)


def plan_export_correction(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Plan the runs at a number that is moved by what the one found misses."""
    plan_correction(_spec(study, source), _evidence(study, source), output)


def export_rolling(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write rolling.json: the conversion of rolling friction."""
    correction = read_scan(source.correction, study.config.target.metric)
    found = conclude(
        parse_spec(_spec(study, source)),
        _evidence(study, source),
        correction,
        in_ascii(unit_of(study.config.target.metric)),
    )
    write_json(output.rolling, found)


def _evidence(study, source):
    """What the search and its confirmation gave."""
    metric = study.config.target.metric
    return Evidence(
        read_scan(source.scan, metric),
        read_scan(source.confirmation, metric),
        study.table("validation", "runs")["response"],
        study.config.validation.margin,
    )


def about(study: Study) -> list[str]:
    """Lines of provenance for the head of each file: what the validation found and, where the
    answer is at hand, what it says of every measured row."""
    config, validation = study.config, study.summary("validation")
    unit, metric = in_ascii(unit_of(config.target.metric)), config.target.metric
    found = answer_of(study)
    return [
        f"Study {config.name}: {metric} measured {validation['measured_mean']:.2f} {unit} "
        f"({validation['measured_n']} values, sd {validation['measured_sd']:.2f}); the calibrated "
        f"model gives "
        f"{validation['simulated_mean']:.2f} {unit} ({validation['simulated_n']} runs, sd "
        f"{validation['simulated_sd']:.2f}) in the rig and with the grains of calibrated.yaml.",
        *(head(found) if found else []),
        f"Engine {engine_of(config)}. SI units. How each number was converted: "
        "docs/other-codes.md.",
    ]


def engine_of(config: Config) -> str:
    """What made the study's runs: this engine by its fingerprint, or another one by its version."""
    other = config.own_run.get("engine")
    if not other:
        return engine_fingerprint()
    return " ".join([other["name"], str(other["identity"].get("version", ""))]).strip()


def known_parameters(
    study: Study, spec: RunSpec, calibrated: Mapping[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """`entries` of a run spec of a study; calibrated: those of the factors that were calibrated."""
    config = study.config
    return entries(
        spec,
        config.own_run,
        calibrated,
        fixed_entries(config, study.factors, study.bench_levels()),
        published_values(config.published.tables),
        config.published.names,
    )


def summary(
    study: Study, mapping: Mapping[str, Any], known: Mapping[str, dict], more: Mapping[str, Any]
) -> dict[str, Any]:
    """Content of calibrated.yaml. mapping: run spec at the parameters handed out; known: entries of
    those that were calibrated; more: what their way says besides."""
    config, validation = study.config, study.summary("validation")
    spec, metric = parse_spec(mapping), config.target.metric
    exports = f"{config.results}/{config.name}/exports"
    return {
        "study": config.name,
        "engine": engine_of(config),
        "commands": {
            "the whole study": f"calibration run {exports}/study.yaml",
            "one run at the calibrated point": f"dem run {exports}/dem.yaml --out heap",
            "the same angle with the rolling friction of other codes": f"calibration run "
            f"{exports}/study.yaml export_converted",
        },
        "target": {
            "metric": metric,
            "unit": in_ascii(unit_of(metric)),
            "file": config.measurements,
            "measured_mean": validation["measured_mean"],
            "measured_sd": validation["measured_sd"],
            "measured_n": validation["measured_n"],
        },
        "validated": _validated(validation, in_ascii(unit_of(metric))),
        **more,
        "parameters": known_parameters(study, spec, known),
        "not_converted": left_out(spec),
    }


def by_chain(
    optimum: Mapping[str, Any], runs: pd.DataFrame, region: Sequence[Factor]
) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """({key: entry} of the factors that the chain calibrated, what calibrated.yaml says of the
    solution). optimum: content of optimum.json; runs: those whose values the surface is fitted
    to."""
    fitted = with_value(runs, "response")
    surface = fit_surface(fitted, [f.code for f in region], fitted["response"])
    solution = {
        "rule": optimum["rule"],
        "attainable": optimum["attainable"],
        "predicted": optimum["predicted"],
        "confirmation_interval_95": optimum["confirmation_interval"],
        "note": "One response does not fix several parameters: solution_set is the range of each "
        "over all points that give the measured value. interval_95_others_held covers 95 % only "
        "if the others are exactly right; the stage `posterior` gives the interval that covers it "
        "whatever they are.",
    }
    return calibrated_entries(surface, region, optimum), {"solution": solution}


def _validated(validation, unit):
    return {
        "mean": validation["simulated_mean"],
        "sd": validation["simulated_sd"],
        "runs": validation["simulated_n"],
        "difference": validation["difference"],
        "difference_interval_95": [validation["difference_low"], validation["difference_high"]],
        "margin": validation["margin"],
        "equivalent": validation["equivalent"],
        "unit": unit,
    }


def export(study: Study, source: NamedFiles, output: NamedFiles) -> None:
    """Write calibrated.yaml and exports/ beside it, without any run."""
    if source.get("draws"):
        found = by_joint(study, read_json(source.joint[0]), read_written(source.predictions[0]))
    else:
        region = read_region(source.optimum)
        runs = augmented_runs(study.config, source.runs, region, source.candidate)
        found = by_chain(read_json(source.optimum), runs, region)
    write_exports(study, _spec(study, source), *found, Path(output.parameters).parent)


def write_exports(
    study: Study,
    mapping: dict[str, Any],
    known: Mapping[str, dict[str, Any]],
    more: Mapping[str, Any],
    out: str | Path,
) -> None:
    """Write calibrated.yaml and exports/ into folder `out`, each file atomically; see `summary`."""
    lines, exports = about(study), Path(out) / "exports"
    data = summary(study, mapping, known, more)
    write_set(mapping, data, lines, exports, Path(out) / "calibrated.yaml", _expected(study))
    _write_decks(study, mapping, Conversion(parse_spec(mapping)), lines, exports)
    write_text(to_yaml(study.config.model_dump(mode="json")), exports / "study.yaml")


def write_set(
    mapping: dict[str, Any],
    data: Mapping[str, Any],
    lines: Sequence[str],
    folder: Path,
    parameters: str | Path,
    expected: Expected | None = None,
) -> None:
    """Write one set of parameters: the blocks of all codes and dem.yaml into a folder, and
    `parameters`, calibrated.yaml.

    mapping: run spec; data: content of calibrated.yaml; lines: of provenance; expected: of the heap
    that the set gives.
    """
    conversion = Conversion(parse_spec(mapping))
    _write_blocks(mapping, conversion, lines, folder)
    for name, code in BY_HAND.items():
        about = [*lines, *left_out(conversion.spec, code)]
        text = by_hand.block(
            code, granulate(conversion.spec), conversion, about, data["parameters"], expected
        )
        write_text(text, folder / name)
    head = "".join(f"# {line}\n" for line in lines)
    write_text(head + to_yaml(mapping), folder / "dem.yaml")
    write_text(head + to_yaml(data), parameters)


def export_converted(study: Study, source: NamedFiles, output: Sequence[str]) -> None:
    """Write the blocks of codes with other rolling laws, with what the search found."""
    mapping = _spec(study, source)
    conversion = Conversion(parse_spec(mapping), study.summary("export_correction", "rolling"))
    lines = about(study)
    _write_blocks(mapping, conversion, lines, Path(output[0]).parent)
    _write_decks(study, mapping, conversion, lines, Path(output[0]).parent)


def _validated_heap(study):
    """What the calibrated model gives, as decks compare with it."""
    stated, target = study.summary("validation"), study.config.target.metric
    return {
        "metric": target,
        "mean": stated["simulated_mean"],
        "sd": stated["simulated_sd"],
        "runs": stated["simulated_n"],
        "margin": stated["margin"],
        "unit": in_ascii(unit_of(target)),
    }


def _expected(study):
    heap = _validated_heap(study)
    mean, spread = heap["mean"], scatter_of_one(heap)
    del heap["margin"]
    return Expected(**heap, low=mean - spread, high=mean + spread)


def _write_decks(study, mapping, conversion, lines, folder):
    expected = _validated_heap(study) | {"heaps": _profiles(study)}
    write_decks(parse_spec(mapping), conversion, lines, expected, folder)


def _profiles(study):
    """Profiles of the validation's heaps whose last states are at hand."""
    store, found = RunStore(), []
    for name in study.table("validation", "runs")["run_id"]:
        with suppress(DemError):  # moved here without its state, or no heap
            run = read_run(store.folder(name))
            if plate := plate_of(run.spec):
                found.append(profile(run.position, run.radius, run.velocity, plate))
    return found


def _write_blocks(mapping, conversion, lines, folder):
    spec = parse_spec(mapping)
    for name, code in CONVERTED.items():
        about = [*lines, *left_out(spec, code.CODE)]
        write_text(code.block(granulate(spec), conversion, about), folder / name)
