"""The files of a new study: its configuration, the factors, the measured values, and a page that
tells where each given value went."""

import re
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
import yaml

from calibration.errors import CalibrationError
from calibration.files import write_table, write_text
from calibration.study.config import Config, parse_config
from calibration.study.factors import COLUMNS, Factor
from calibration.study.new.heap import STEEL
from calibration.study.new.laboratory import CLUMP, Laboratory
from dem.contact.catalogue import DEFAULTS
from dem.errors import DemError

LAWS = {slot: DEFAULTS[slot] for slot in ("rolling", "torsion")}
"""Laws that the file of a new material names: the engine's defaults, so that they are seen."""
MEASURED, GIVEN, PAGE = "measured.csv", "given.csv", "README.md"
MARGINS = {"angle_of_repose_deg": 1.0}
MARGIN = 0.02  # of any other target: a difference that does not matter
_REFUSED = re.compile(r"[^\w\s.,()+/-]|\s\s|^\s|\s$|[\n\t]")


def study_name(folder: str | Path) -> str:
    """Name of a folder's study: its letters without accents, `_` for the rest.

    Raises CalibrationError for a name that a shell or snakemake would take apart.
    """
    name = Path(folder).name
    if not name or _REFUSED.search(name):
        raise CalibrationError(
            f"{str(folder)!r}: cannot be a study's folder; allowed: letters, digits, single spaces "
            "and . , ( ) + - _"
        )
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_") or "study"


def check_folder(folder: str | Path) -> str:
    """Name of a study that could begin in `folder`. Raises CalibrationError where none could."""
    name = study_name(folder)
    if Path(folder).exists():
        raise CalibrationError(f"{folder}: exists already")
    return name


def write_factors(path: str | Path, factors: Sequence[Factor]) -> None:
    """Write a factor table, atomically."""
    rows = ["\t".join(str(getattr(f, c)) for c in COLUMNS) for f in factors]
    head = "# low and high: natural levels at -1 and +1; description: where they come from\n"
    write_text(head + "\n".join(["\t".join(COLUMNS), *rows]) + "\n", path)


def write_study(lab: Laboratory, check: Callable[[Config], None] | None = None) -> list[str]:
    """Write the study's files into its new folder and check them; check: a further check of the
    configuration. Returns sentences: what was chosen. Raises CalibrationError, with nothing
    left."""
    folder = lab.folder
    folder.mkdir(parents=True)
    try:
        write_table(_measured(lab.tests), folder / MEASURED)
        write_table(pd.DataFrame(lab.given), folder / GIVEN)
        if lab.grains.spheres:
            columns = ["x_mm", "y_mm", "z_mm", "radius_mm"]
            write_table(pd.DataFrame(lab.grains.spheres, columns=columns), folder / CLUMP)
        write_settings(lab)
        config = parse_config(yaml.safe_load(configuration(lab)), files=[folder / "config.yaml"])
        if check:
            check(config)
    except (CalibrationError, DemError) as error:
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()
        # the files it may name are gone
        fault = re.sub(rf"^{re.escape(str(folder))}/[\w.]+(, line \d+)?: ", "", str(error))
        raise CalibrationError(f"what was given makes no study that can run: {fault}") from None
    return lab.said


def write_settings(lab: Laboratory) -> None:
    """Write what a pilot may change: the configuration, the factors and the page."""
    write_factors(lab.folder / "factors.tsv", lab.factors)
    write_text(configuration(lab), lab.folder / "config.yaml")
    write_text(page(lab), lab.folder / PAGE)


def _measured(tests):
    columns = ["experiment", "quantity", "value", "unit", "sd", "n"]
    table = pd.DataFrame([row for t in tests for row in t.rows])
    levers = [c for c in table.columns if c not in (*columns, "role", "note")]
    order = [*columns, *levers, *(c for c in ("role", "note") if c in table.columns)]
    table = table.reindex(columns=order)
    return (
        table.astype({"n": "Int64"})
        if table["n"].notna().any()
        else table.drop(columns=["sd", "n"])
    )


def _yaml(data, indent=0):
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=1000)
    return "".join(f"{' ' * indent}{line}\n" for line in text.splitlines())


def configuration(lab: Laboratory) -> str:
    """The text of the study's config.yaml."""
    lead, path = lab.leading, lab.folder.as_posix()
    quoted = yaml.safe_dump(path, allow_unicode=True, width=1000).splitlines()[0]
    fixed = {f.name: float(f"{f.centre:.4g}") for f in lab.factors}
    metric = lead.metrics[0]
    margin = MARGINS.get(metric) or float(f"{MARGIN * lead.rows[0]['value']:.3g}")
    laws = dict(LAWS) | ({"cohesion": "jkr"} if lab.grains.sticky else {})
    run = {
        "materials": {
            "particle": {
                "density_kg_m3": lab.grains.density_kg_m3,
                "shear_modulus_Pa": lab.grains.shear_modulus_Pa,
            },
            "wall": {
                "density_kg_m3": STEEL.density,
                "shear_modulus_Pa": STEEL.shear_modulus,
                "poisson_ratio": STEEL.poisson_ratio,
            },
        },
        "laws": laws,
        **_energies(lab),
    } | lead.run
    joint = f"#   calibration run {quoted} joint    all tests together\n"
    files = {n: yaml.safe_dump(f"{path}/{n}", allow_unicode=True, width=1000).splitlines()[0]
             for n in ("factors.tsv", MEASURED)}  # fmt: skip
    supplements = "posterior" if lab.alone else "joint, joint_export"
    return f"""\
# A study of {lab.folder.name}. From the folder that {quoted} lies in:
{"" if lab.alone else joint}\
#   calibration run {quoted}          all of it, and results/{lab.name}/report.html
#   --config resolution=quick beside it: a quarter of the grains of {lead.rig}, for a first look
# README.md beside this file says where each value that you gave went.
name: {lab.name}
factors: {files["factors.tsv"]}
measurements: {files[MEASURED]}
experiment: {lead.experiment}
target: {{ metric: {metric} }}
supplements: [{supplements}] # the report waits for the parameters as a distribution

fixed: # a factor's level while it is not varied: the middle of its range
{_yaml(fixed, 2)}
# what all runs share; the shear modulus is softened, for longer time steps; walls are as stiff as
# steel
run:
{_yaml(run, 2)}
{"" if lab.alone else _all_tests(lab)}\
screening: {{ at_least: 3, at_most: 3 }}
ascent: {{ rule: effects, steps: 5 }}
# margin: a difference that does not matter, in the unit of {metric}
validation: {{ groups: 2, replicates: 5, margin: {margin:g} }}
{_diagnosed(lab)}"""


def _all_tests(lab):
    return f"""\
rigs: # each test as it is simulated; {lab.leading.rig} is the study's own run
{_yaml(_rigs(lab), 2)}
targets:
{_yaml(_targets(lab.tests), 2)}
"""


def _energies(lab):
    """The constants of the law of cohesion, in the middle of their ranges."""
    own = {f.key.removeprefix("law_parameters."): f.centre for f in lab.factors
           if f.key.startswith("law_parameters.")}  # fmt: skip
    return {"law_parameters": {k: float(f"{v:.4g}") for k, v in own.items()}} if own else {}


def _diagnosed(lab):
    """Lines: the rigs in which the diagnosis simulates the tests that are not the study's own
    experiment; the settings of measured.csv are laid over them."""
    found: dict = {}
    for test in lab.tests[1:]:
        if test.experiment != lab.leading.experiment:
            found.setdefault(test.experiment, {"run": test.run})
    if not found:
        return ""
    text = _yaml({"experiments": found}, 2)
    return f'diagnosis: # what "calibration run ... diagnose" simulates each test in\n{text}'


def _rigs(lab):
    own = {lab.leading.rig: {"experiment": lab.leading.experiment}}
    return own | {t.rig: {"experiment": t.experiment, "run": t.run} for t in lab.tests[1:]}


def _targets(tests):
    return [
        {"rig": t.rig, "metric": metric}
        | ({"discrepancy": t.discrepancy[metric]} if metric in t.discrepancy else {})
        for t in tests
        for metric in t.metrics
    ]


def page(lab: Laboratory) -> str:
    """The text of the study's README.md: what was chosen, and where each given value went."""
    lines = ([r["test"], r["question"], f"{r['value']} {r['unit']}".strip(), r["became"]]
             for r in lab.given)  # fmt: skip
    rows = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    chosen = "\n".join(f"- {s[0].upper()}{s[1:]}." for s in lab.said)
    ranges = "\n".join(
        f"| {f.name} | {f.low:g} | {f.high:g} | {f.description} |" for f in lab.factors
    )
    return f"""\
# {lab.folder.name}

`calibration run {lab.folder.as_posix()}{"" if lab.alone else " joint"}` calibrates to all of it.

## Where each value went

| test | question | value | became |
|---|---|---|---|
{rows}

## What was chosen

{chosen or "- Nothing beyond what was given."}

## Ranges

| factor | low | high | source |
|---|---|---|---|
{ranges}
"""
