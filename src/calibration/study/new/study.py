"""The files of a new study: its configuration, the factors, the measured values, and a page that
tells where each given value went."""

import re
import shutil
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
import yaml

from calibration.engines.templates import macros
from calibration.errors import CalibrationError
from calibration.files import write_table, write_text
from calibration.study.config import Config, parse_config, point_spec
from calibration.study.cost import run_seconds
from calibration.study.factors import COLUMNS, Factor
from calibration.study.new.laboratory import CLUMP, Laboratory
from calibration.study.new.methods.declare import refusal
from calibration.study.new.methods.heaps import STEEL
from dem.contact.catalogue import DEFAULTS
from dem.errors import DemError

LAWS = {slot: DEFAULTS[slot] for slot in ("rolling", "torsion")}
"""Laws that the file of a new material names: the engine's defaults, so that they are seen."""
MEASURED, GIVEN, PAGE = "measured.csv", "given.csv", "README.md"
MARGINS = {"angle_of_repose_deg": 1.0}
MARGIN = 0.02  # of any other target: a difference that does not matter
DESIGNS_S, DESIGN_RUNS = 1200.0, 36
"""Time of one core [s] for the runs of screening and surface, and their number when each is made
once: 19 for seven factors and 17 for three."""
MOST_REPLICATES = 4
"""Of a design. The effects on heaps of 1,500 grains have a standard error of 1.4° by one screening
of 19 runs, 0.6° by four."""
_REFUSED = re.compile(r"[^\w\s.,()+/-]|\s\s|^\s|\s$|[\n\t]")


def study_name(folder: str | Path) -> str:
    """Name of a folder's study: its letters without accents, `_` for the rest.

    Raises CalibrationError for a name that a shell or snakemake would take apart.
    """
    name = Path(folder).name
    if not name or _REFUSED.search(name):
        raise refusal("no_folder_name", repr(str(folder)))
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
        shutil.rmtree(folder)
        # the files it may name are gone
        fault = re.sub(rf"^{re.escape(str(folder))}/[\w.]+(, line \d+)?: ", "", str(error))
        raise CalibrationError(f"what was given makes no study that can run: {fault}") from None
    return lab.said


def write_settings(lab: Laboratory) -> None:
    """Write what atlas and pilot may change: the configuration, the factors and the page."""
    write_factors(lab.folder / "factors.tsv", lab.factors)
    write_text(configuration(lab), lab.folder / "config.yaml")
    write_text(macros("calibration.study.new", "files").page(lab), lab.folder / PAGE)


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


def configuration(lab: Laboratory) -> str:
    """The text of the study's config.yaml."""
    return _text(lab, _replicates(lab))


def _replicates(lab):
    """How often screening and surface are run: as DESIGNS_S allows, at most MOST_REPLICATES."""
    config = parse_config(yaml.safe_load(_text(lab, 1)))
    seconds = run_seconds(point_spec(config.own_run, config.experiment, {}, config.seed))
    often = int(DESIGNS_S / (DESIGN_RUNS * (seconds or DESIGNS_S)))  # once where nothing tells
    return min(max(often, 1), MOST_REPLICATES)


def _text(lab, often):
    """The text of config.yaml with designs that are run so often."""
    lead, path = lab.leading, lab.folder.as_posix()
    metric = lead.metrics[0]
    parts = {"path": path, "factors": f"{path}/factors.tsv", "measured": f"{path}/{MEASURED}"}
    parts = {name: _yaml(text).splitlines()[0] for name, text in parts.items()}
    sections = {
        "fixed": {f.name: float(f"{f.centre:.4g}") for f in lab.factors},
        "run": _shared_run(lab),
        "tests": {t.rig: _test(t) for t in lab.tests},
    }
    parts |= {name: _yaml(section, 2) for name, section in sections.items()}
    margin = MARGINS.get(metric) or float(f"{MARGIN * lead.rows[0]['value']:.3g}")
    return macros("calibration.study.new", "files").config(
        lab.folder.name, lab.name, lab.alone, lead.rig, metric, margin, parts, often
    )


def _yaml(data, indent=0):
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=1000)
    return "".join(f"{' ' * indent}{line}\n" for line in text.splitlines())


def _shared_run(lab):
    """Return what all runs share, with the constants of a law of cohesion in the middle of their
    ranges."""
    grain = {
        "density_kg_m3": lab.grains.density_kg_m3, "shear_modulus_Pa": lab.grains.shear_modulus_Pa
    }  # fmt: skip
    wall = {
        "density_kg_m3": STEEL.density,
        "shear_modulus_Pa": STEEL.shear_modulus,
        "poisson_ratio": STEEL.poisson_ratio,
    }
    laws = dict(LAWS) | ({"cohesion": "jkr"} if lab.grains.sticky else {})
    own = {f.key.removeprefix("law_parameters."): float(f"{f.centre:.4g}") for f in lab.factors
           if f.key.startswith("law_parameters.")}  # fmt: skip
    shared = {"materials": {"particle": grain, "wall": wall}, "laws": laws}
    return shared | ({"law_parameters": own} if own else {})


def _test(test):
    doubt = {"discrepancy": test.discrepancy} if test.discrepancy else {}
    own = {"experiment": test.experiment, "metrics": list(test.metrics), "run": test.run}
    return own | doubt
