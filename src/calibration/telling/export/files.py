"""The files that a study hands on: calibrated.yaml, the blocks of other codes and their decks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from calibration.chain.study import Study
from calibration.engines import lammps, liggghts, yade
from calibration.engines.conversion import Conversion, Granulate, left_out
from calibration.files import write_text
from calibration.runs.store import RunStore
from calibration.telling.answer.schema import answer_of
from calibration.telling.answer.words import head
from calibration.telling.export import by_hand, mercurydpm
from calibration.telling.export.decks import profiles, scatter_of_one, write_decks
from calibration.telling.export.parameters import engine_of, known_parameters, to_yaml
from dem.spec import parse_spec
from dem.units import in_ascii, unit_of

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


def about(study: Study) -> list[str]:
    """Lines of provenance for the head of each file: what the validation found and, where the
    answer is at hand, what it says of every measured row."""
    config, validation = study.config, study.summary("validation")
    unit, metric = in_ascii(unit_of(config.target)), config.target
    found = answer_of(study)
    return [
        f"Study {config.name}: {metric} measured {validation['measured_mean']:.2f} {unit} "
        f"({validation['measured_n']} values, sd {validation['measured_sd']:.2f}); the calibrated "
        f"model gives {validation['simulated_mean']:.2f} {unit} ({validation['simulated_n']} runs, "
        f"sd {validation['simulated_sd']:.2f}) in the rig and with the grains of calibrated.yaml.",
        *(head(found) if found else []),
        f"Engine {engine_of(config)}. SI units. How each number was converted: "
        "docs/other-codes.md.",
    ]


def summary(
    study: Study, mapping: Mapping[str, Any], known: Mapping[str, dict], more: Mapping[str, Any]
) -> dict[str, Any]:
    """Content of calibrated.yaml. mapping: run spec at the parameters handed out; known: entries of
    those that were calibrated; more: what their way says besides."""
    config, validation = study.config, study.summary("validation")
    spec, metric = parse_spec(mapping), config.target
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
        "target": {"metric": metric, "unit": in_ascii(unit_of(metric)), "file": config.measurements}
        | {key: validation[key] for key in ("measured_mean", "measured_sd", "measured_n")},
        "validated": _validated(study),
        **more,
        "parameters": known_parameters(study, spec, known),
        "not_converted": left_out(spec),
    }


def _validated(study):
    validation = study.summary("validation")
    return {
        "mean": validation["simulated_mean"],
        "sd": validation["simulated_sd"],
        "runs": validation["simulated_n"],
        "difference": validation["difference"],
        "difference_interval_95": [validation["difference_low"], validation["difference_high"]],
        "margin": validation["margin"],
        "equivalent": validation["equivalent"],
        "unit": in_ascii(unit_of(study.config.target)),
    }


def write_exports(
    study: Study,
    mapping: dict[str, Any],
    known: Mapping[str, dict[str, Any]],
    more: Mapping[str, Any],
    out: str | Path,
) -> None:
    """Write calibrated.yaml and exports/ into folder `out`, each file atomically; see `summary`."""
    lines, folder, conversion = about(study), Path(out) / "exports", Conversion(parse_spec(mapping))
    data, expected = summary(study, mapping, known, more), _validated_heap(study)
    spread = scatter_of_one(expected)
    expected |= {"low": expected["mean"] - spread, "high": expected["mean"] + spread}
    _write_codes(study, conversion, lines, folder)
    for name, code in BY_HAND.items():
        told, grains = [*lines, *left_out(conversion.spec, code)], Granulate(conversion.spec)
        text = by_hand.block(code, grains, conversion, told, data["parameters"], expected)
        write_text(text, folder / name)
    head = "".join(f"# {line}\n" for line in lines)
    write_text(head + to_yaml(mapping), folder / "dem.yaml")
    write_text(head + to_yaml(data), Path(out) / "calibrated.yaml")
    write_text(to_yaml(study.config.model_dump(mode="json")), folder / "study.yaml")


def write_converted(
    study: Study, mapping: dict[str, Any], rolling: Mapping[str, Any], folder: Path
) -> None:
    """Write the blocks and decks of codes with other rolling laws into a folder; rolling: what the
    search found."""
    _write_codes(study, Conversion(parse_spec(mapping), rolling), about(study), folder)


def _validated_heap(study):
    """Return what the calibrated model gives, as decks compare with it."""
    stated = _validated(study)
    kept = {key: stated[key] for key in ("mean", "sd", "runs", "margin", "unit")}
    return {"metric": study.config.target} | kept


def _write_codes(study, conversion, lines, folder):
    """Write the blocks and decks of the codes that may need another law."""
    spec = conversion.spec
    for name, code in CONVERTED.items():
        about = [*lines, *left_out(spec, code.CODE)]
        write_text(code.block(Granulate(spec), conversion, about), folder / name)
    runs = study.table("validation", "runs")["run_id"]
    expected = _validated_heap(study) | {"heaps": profiles(runs, RunStore())}
    write_decks(spec, conversion, lines, expected, folder)
