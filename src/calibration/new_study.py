"""Begin a study: a folder with a commented configuration, a factor table and an empty table of measured values.

`python -m calibration.new_study FOLDER` writes them. The configuration is made from the schemas, so that it cannot
disagree with them.
"""

import argparse
import sys
from itertools import product
from pathlib import Path

from calibration.config import Config, section_of
from calibration.factors import COLUMNS, Factor
from dem.template import template as run_template

CONTACTS = {"wall": "particle_wall", "grain": "particle_particle"}
RANGES = {"restitution": (0.2, 0.8), "static_friction": (0.2, 0.8), "rolling_friction": (0.02, 0.4)}
POISSON = Factor("G", "grain_poisson_ratio", "materials.particle.poisson_ratio", 0.2, 0.4)
FACTORS = (
    *(
        Factor(code, f"grain_{other}_{quantity}", f"contacts.{pair}.{quantity}", *limits)
        for code, ((other, pair), (quantity, limits)) in zip(
            "ABCDEF", product(CONTACTS.items(), RANGES.items()), strict=True
        )
    ),
    POISSON,
)
"""The usual contact parameters with wide ranges, to be narrowed to what is known of the material."""

SECTIONS = ("target", "screening", "ascent", "response_surface", "optimise", "validation")
FURTHER = """\
# further_targets: # more responses; the optimum is then the most desirable point, and `target` needs low and high too
#   - { metric: height_mm, file: heights.csv, column: height_mm, low: 10, high: 40, margin: 2 }
#   - { metric: spilled, goal: minimise, low: 0, high: 200 }
"""


def write_study(folder):
    """Write config.yaml, factors.tsv and measured.csv into a new folder. Raises FileExistsError when it is there."""
    folder = Path(folder)
    folder.mkdir(parents=True)
    (folder / "factors.tsv").write_text(factor_table())
    (folder / "measured.csv").write_text("# one measured value a line, two or more\nangle_deg\n")
    (folder / "config.yaml").write_text(configuration(folder))


def factor_table():
    """Text of a factor table with `FACTORS`."""
    rows = ["\t".join(COLUMNS)]
    rows += ["\t".join(str(getattr(f, c)) for c in COLUMNS) for f in FACTORS]
    return (
        "# key: what the factor sets in a run spec; low and high: natural levels at -1 and +1\n"
        + "\n".join(rows)
        + "\n"
    )


def configuration(folder):
    """YAML text of a study in `folder`, every key with its meaning."""
    folder = Path(folder)
    text = (
        f"# A study of {folder.name}. Run it from the root of the project:\n"
        f"#   snakemake -n --configfile {folder / 'config.yaml'}   (what it would do)\n"
        f"#   snakemake -j2 --configfile {folder / 'config.yaml'}\n"
        "# config/README.md walks through it. Values below are defaults or wide guesses; make them your material's.\n"
    )
    fields = Config.model_fields
    text += f"name: {folder.name} # {fields['name'].description}\n"
    text += f"seed: 1 # {fields['seed'].description}\n"
    text += f"factors: {folder / 'factors.tsv'} # {fields['factors'].description}\n"
    text += f"experiment: heap # {fields['experiment'].description}\n\n"
    values = {"file": str(folder / "measured.csv"), "column": "angle_deg"}
    text += section("target", values) + FURTHER + "\n"
    text += f"fixed: # {fields['fixed'].description}; here the middle of each range\n"
    text += "".join(f"  {f.name}: {f.centre:g} # {f.low:g} to {f.high:g}\n" for f in FACTORS)
    text += (
        "\nrun: # the run spec that all runs share; factors set the contacts and Poisson's ratio\n"
    )
    text += shared_run()
    for name in SECTIONS[1:]:
        text += "\n" + section(name, {"rule": "effects"} if name == "ascent" else {})
    return text


def section(name, values):
    """YAML text of a section of the configuration with its defaults, or `values` in place of them."""
    text = f"{name}:\n"
    for key, field in section_of(Config.model_fields[name].annotation).model_fields.items():
        value = values.get(key, field.default)
        shown = "null" if value is None else value
        text += f"  {key}: {shown} # {field.description}\n"
    return text


def shared_run():
    """The commented run spec of a heap, indented, without what a study sets itself."""
    own, skip, lines = ("experiment", "seed", "contacts", "output"), False, []
    for line in run_template("heap").splitlines():
        if not line.startswith((" ", "#")):
            skip = line.split(":")[0] in own
        if not skip and not line.startswith("#"):
            lines.append(f"  {line}")
    return "\n".join(lines) + "\n"


def main(argv=None):
    """Entry point; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m calibration.new_study", description=__doc__)
    parser.add_argument("folder", type=Path, help="folder to write; its name becomes the study's")
    folder = parser.parse_args(argv).folder
    try:
        write_study(folder)
    except OSError as error:
        print(f"{folder}: {error.strerror}", file=sys.stderr)
        return 2
    print(
        f"wrote {folder}/config.yaml, factors.tsv and measured.csv; config/README.md says what to change"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
