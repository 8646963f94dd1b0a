"""Keeps the results of a finished study under results/reference/ and writes them beside the paper's into the README.

python -m calibration.reference results/salt
"""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd

KEPT = ("*.json", "effects.csv", "anova.csv", "runs.csv", "coefficients.csv", "numerics.csv")
BEGIN, END = "<!-- results: begin -->", "<!-- results: end -->"
PAPER = Path("data/paper")


def keep(study, target):
    """Copy the summaries and tables of a study's stages; plans and figures stay behind."""
    for folder in sorted(p for p in Path(study).iterdir() if p.is_dir() and p.name != "logs"):
        for pattern in KEPT:
            for path in folder.glob(pattern):
                if path.name != "plan.json":
                    (Path(target) / folder.name).mkdir(parents=True, exist_ok=True)
                    shutil.copy(path, Path(target) / folder.name / path.name)


def _load(study, stage, name):
    path = Path(study) / stage / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def _scalars():
    table = pd.read_csv(PAPER / "scalars.csv", comment="#").set_index("name")
    return table["value"]


def rows(study):
    """(what, paper, this project) of the study's results, as text."""
    scalar, out = _scalars(), []
    screening = _load(study, "screening", "screening")
    printed = pd.read_csv(PAPER / "table07_plackett_burman_anova.csv", comment="#").set_index(
        "source"
    )
    factors = pd.read_csv(PAPER / "table05_contact_parameter_ranges.csv", comment="#")
    table6 = pd.read_csv(PAPER / "table06_plackett_burman.csv", comment="#")
    for f in factors.itertuples():
        effect = 2 * float((table6[f.factor] * table6["angle_deg"]).mean())
        ours, p = screening["effects"][f.name], screening["p"][f.name]
        out.append(
            (
                f"effect of {f.name.replace('_', ' ')} [°]",
                f"{effect:+.2f} (p {printed.loc[f.factor, 'p']})",
                f"{ours:+.2f} (p {p:.2g})",
            )
        )
    runs = pd.read_csv(Path(study) / "screening" / "runs.csv")
    rms = float(np.sqrt(((runs["response"] - table6["angle_deg"]) ** 2).mean()))
    spans = [f"{x.min():.1f} to {x.max():.1f}" for x in (table6["angle_deg"], runs["response"])]
    out.append(
        ("angles of Table 6 [°]", spans[0], f"{spans[1]}, run by run {rms:.1f}° apart (rms)")
    )
    ascent = _load(study, "ascent", "ascent")
    table10 = pd.read_csv(PAPER / "table10_steepest_ascent.csv", comment="#")
    path = ", ".join(f"{a:.1f}" for a in ascent["responses"])
    out.append(
        (
            "ascent [°]",
            ", ".join(f"{a:.1f}" for a in table10["angle_deg"]),
            f"{path} (path from our {ascent['path']})",
        )
    )
    surface = _load(study, "response_surface", "response_surface")["statistics"]
    summary = pd.read_csv(PAPER / "table12_summary.csv", comment="#").set_index("statistic")[
        "value"
    ]
    names = {"R2": "R²", "R2_adj": "R² adjusted", "R2_pred": "R² predicted", "CV_percent": "CV [%]"}
    for key, name in (names | {"adequate_precision": "adequate precision"}).items():
        out.append((f"response surface: {name}", f"{summary[key]:g}", f"{surface[key]:.3g}"))
    optimum = _load(study, "optimise", "optimum")
    theirs = "rolling 0.23, restitution 0.544, rolling on steel 0.368"
    ours = ", ".join(f"{k.replace('_', ' ')} {v:.3f}" for k, v in optimum["optimum"].items())
    out.append(("optimum", theirs, ours))
    validation = _load(study, "validation", "validation")
    error = abs(
        scalar_of(scalar, "validated_angle_of_repose")
        - scalar_of(scalar, "measured_angle_of_repose")
    )
    error *= 100 / scalar_of(scalar, "measured_angle_of_repose")
    out.append(
        (
            "validated angle [°]",
            f"{scalar['validated_angle_of_repose']} against {scalar['measured_angle_of_repose']}: {error:.1f} %",
            f"{validation['simulated_mean']:.2f} ± {validation['simulated_sd']:.2f} against "
            f"{validation['measured_mean']:.2f}: {validation['relative_error_percent']:.2f} %",
        )
    )
    for test, name, key in (
        ("tilt", "salt_steel_static_friction", "friction on steel from the tilted plane"),
        ("drop", "salt_steel_restitution", "restitution on steel from the drop"),
    ):
        found = _load(study, test, test)
        if found:
            out.append(
                (
                    key,
                    str(scalar[name]),
                    f"{found['inverse']:.3f}; {found['closed_form_of']} {found['closed_form']:.3f}",
                )
            )
    shear = _load(study, "shear", "shear")
    if shear:
        steady, measured = shear["steady"], shear["measured"]
        out.append(
            (
                "yield locus [kPa]",
                f"{measured['slope']} x + {measured['intercept_kPa']}",
                f"{steady['slope']:.2f} x {steady['intercept_kPa']:+.2f} (steady state)",
            )
        )
    return out


def scalar_of(table, name):
    """One of the paper's single figures as a number."""
    return float(table[name])


def table(study):
    """Markdown table of `rows`."""
    lines = ["| | paper (EDEM) | this project |", "|---|---|---|"]
    return "\n".join(lines + [f"| {a} | {b} | {c} |" for a, b, c in rows(study)])


def main(study):
    """Keep the study's results and put its table into the README."""
    name = Path(study).name
    target = Path("results/reference") / name
    if Path(study).resolve() != target.resolve():
        keep(study, target)
    readme = Path("README.md")
    text = readme.read_text()
    before, rest = text.split(BEGIN, 1)
    after = rest.split(END, 1)[1]
    readme.write_text(f"{before}{BEGIN}\n{table(target)}\n{END}{after}")


if __name__ == "__main__":
    main(sys.argv[1])
