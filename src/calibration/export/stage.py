"""The stage `export`: plans of its runs, and its files."""

import json
import os
from pathlib import Path

import pandas as pd

from calibration.export import edem, lammps, liggghts, mercurydpm, yade
from calibration.export.conversion import Conversion
from calibration.export.header import left_out
from calibration.export.material import granulate
from calibration.export.parameters import (
    calibrated_entries,
    entries,
    fixed_entries,
    paper_values,
    to_yaml,
    unit_of,
)
from calibration.export.rolling import (
    calibrated_spec,
    conclude,
    plan_confirmation,
    plan_scan,
    read_scan,
)
from calibration.factors import read_factors
from calibration.statistics.surface import fit_surface
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from dem.spec import parse_spec

CODES = {
    "liggghts.in": liggghts,
    "lammps.in": lammps,
    "yade.py": yade,
    "mercurydpm.cpp": mercurydpm,
    "edem.md": edem,
}
"""File under exports/ -> module that writes it."""


def _load(path):
    return json.loads(Path(path).read_text())


def _spec(config, optimum_file):
    factors = read_factors(config.factors)
    return calibrated_spec(config, factors, _load(optimum_file)["optimum"])


def plan_export_scan(config, optimum_file, folder):
    """Plan the search for rolling friction in other laws."""
    plan_scan(_spec(config, optimum_file), folder)


def plan_export_confirmation(config, optimum_file, scan_file, folder):
    """Plan the runs that confirm what the search found."""
    plan_confirmation(_spec(config, optimum_file), scan_file, config.target.metric, folder)


def convert(config, optimum_file, scan_file, confirmation_file, validation_runs, output):
    """Write rolling.json: the conversion of rolling friction."""
    metric = config.target.metric
    found = conclude(
        parse_spec(_spec(config, optimum_file)),
        read_scan(scan_file, metric),
        read_scan(confirmation_file, metric),
        pd.read_csv(validation_runs)["response"],
        config.validation.margin,
        unit_of(metric),
    )
    write_json(output, found)


def about(config, validation, engine):
    """Lines of provenance for the head of each file."""
    unit, metric = unit_of(config.target.metric), config.target.metric
    return [
        f"Study {config.name}: {metric} measured {validation['measured_mean']:.2f} {unit} "
        f"({validation['measured_n']} values, sd {validation['measured_sd']:.2f}); the calibrated model gives "
        f"{validation['simulated_mean']:.2f} {unit} ({validation['simulated_n']} runs, sd "
        f"{validation['simulated_sd']:.2f}) in the rig and with the grains of calibrated.yaml.",
        f"Engine {engine}. SI units. How each number was converted: docs/howto-export.md.",
    ]


def summary(config, optimum, validation, surface, region, bench, conversion, paper):
    """Content of calibrated.yaml."""
    factors = read_factors(config.factors)
    spec = parse_spec(calibrated_spec(config, factors, optimum["optimum"]))
    found = entries(
        spec,
        config.run,
        calibrated_entries(surface, region, optimum),
        fixed_entries(config, factors, bench),
        paper if any(f.name in paper for f in factors) else {},
    )
    metric = config.target.metric
    return {
        "study": config.name,
        "engine": engine_fingerprint(),
        "commands": {
            "the whole study": f"snakemake -j2 --configfile results/{config.name}/exports/study.yaml",
            "one run at the calibrated point": f"dem run results/{config.name}/exports/dem.yaml --out heap",
        },
        "target": {
            "metric": metric,
            "unit": unit_of(metric),
            "file": config.target.file,
            "measured_mean": validation["measured_mean"],
            "measured_sd": validation["measured_sd"],
            "measured_n": validation["measured_n"],
        },
        "validated": _validated(validation, unit_of(metric)),
        "solution": {
            "rule": optimum["rule"],
            "attainable": optimum["attainable"],
            "predicted": optimum["predicted"],
            "confirmation_interval_95": optimum["confirmation_interval"],
            "note": "One response does not fix several parameters: solution_set is the range of each over all points "
            "that give the measured value, interval_95 its uncertainty with the others held.",
        },
        "parameters": found,
        "rolling_friction_in_other_laws": conversion.found["laws"],
        "not_converted": left_out(spec),
    }


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


def export(config, inputs, runs, region, out):
    """Write calibrated.yaml and exports/ into folder `out`, each atomically.

    inputs: paths by name (optimum, validation, rolling; fixed: what the bench tests found, or None); runs: table of the
    runs that the response surface was fitted to; region: its factors.
    """
    optimum, validation = _load(inputs["optimum"]), _load(inputs["validation"])
    surface = fit_surface(runs, [f.code for f in region], runs["response"])
    bench = _load(inputs["fixed"])["fixed"] if inputs.get("fixed") else {}
    mapping = calibrated_spec(config, read_factors(config.factors), optimum["optimum"])
    spec = parse_spec(mapping)
    conversion = Conversion(spec, _load(inputs["rolling"]))
    lines = [*about(config, validation, engine_fingerprint()), *left_out(spec)]
    for name, code in CODES.items():
        _write(Path(out) / "exports" / name, code.block(granulate(spec), conversion, lines))
    head = "".join(f"# {line}\n" for line in lines)
    _write(Path(out) / "exports" / "dem.yaml", head + to_yaml(mapping))
    _write(Path(out) / "exports" / "study.yaml", to_yaml(config.model_dump(mode="json")))
    paper = paper_values("data/paper")
    data = summary(config, optimum, validation, surface, region, bench, conversion, paper)
    _write(Path(out) / "calibrated.yaml", head + to_yaml(data))


def _write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    partial.write_text(text)
    os.replace(partial, path)
