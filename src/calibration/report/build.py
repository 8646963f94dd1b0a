"""Collects what a study's stages left and writes it as one self-contained page; parts without files are left out."""

import base64
import json
import re
from pathlib import Path

import pandas as pd
from jinja2 import Environment, PackageLoader

from dem.fingerprint import engine_fingerprint

CAPTIONS = Path("workflow/report")

# stage folder, title, figures with their captions' files, tables with their titles
PARTS = [
    (
        "screening",
        "Screening",
        [("half_normal", "half_normal"), ("pareto", "pareto")],
        [("effects", "Effects"), ("anova", "ANOVA"), ("runs", "Runs")],
    ),
    ("ascent", "Steepest ascent", [("path", "ascent")], [("runs", "Runs")]),
    (
        "response_surface",
        "Response surface",
        [
            ("surfaces", "surfaces"),
            ("predicted_actual", "predicted_actual"),
            ("perturbation", "perturbation"),
            ("residuals", "residuals"),
        ],
        [("anova", "ANOVA"), ("coefficients", "Coefficients"), ("runs", "Runs")],
    ),
    ("optimise", "Optimum", [("contours", "contours")], [("solution_set", "Solution set")]),
    ("validation", "Validation", [("validation", "validation")], [("runs", "Runs")]),
    ("tilt", "Tilted plane", [("tilt", "tilt")], [("runs", "Runs")]),
    ("drop", "Drop", [("drop", "drop")], [("runs", "Runs")]),
    ("shear", "Direct shear", [("yield_locus", "shear")], [("runs", "Runs")]),
    ("numerics", "What the numerical choices cost", [], [("numerics", "Differences in degrees")]),
    ("audit", "The paper's arithmetic", [], [("audit", "Claims, disagreements first")]),
]
SHOWN_ROWS = 400


def build(study, out):
    """Write the report of `study` (a folder under results/) to `out`, atomically."""
    study, out = Path(study), Path(out)
    parts = [part for part in (_part(study, *p) for p in PARTS) if part]
    diagnosis = _diagnosis(study)
    if diagnosis:
        parts.append(diagnosis)
    environment = Environment(loader=PackageLoader("calibration.report", "."), autoescape=True)
    page = environment.get_template("page.html.j2").render(
        name=study.name,
        parameters=_parameters(study),
        answer=_answer(study),
        parts=parts,
        engine=engine_fingerprint(),
    )
    partial = out.with_name(f".{out.name}.partial")
    partial.write_text(page)
    partial.replace(out)


def _load(path):
    return json.loads(path.read_text()) if path.exists() else None


def _parameters(study):
    optimum = _load(study / "optimise" / "optimum.json")
    if not optimum:
        return ""
    rows = [
        {
            "parameter": name.replace("_", " "),
            "calibrated": f"{value:.4g}",
            "over the solution set": "{:.4g} to {:.4g}".format(*optimum["solution_set"][name]),
        }
        for name, value in optimum["optimum"].items()
    ]
    return pd.DataFrame(rows).to_html(index=False, border=0)


def _answer(study):
    validation, optimum = (
        _load(study / "validation" / "validation.json"),
        _load(study / "optimise" / "optimum.json"),
    )
    lines = []
    if validation:
        lines.append(
            f"Validated angle {validation['simulated_mean']:.2f}°, measured {validation['measured_mean']:.2f}°: "
            f"{validation['relative_error_percent']:.2f} % apart."
        )
        word = "equivalent" if validation["equivalent"] else "not shown to be equivalent"
        lines.append(
            f"Difference {validation['difference']:+.2f}° (95 % {validation['difference_low']:+.2f} to "
            f"{validation['difference_high']:+.2f}); {word} within ±{validation['margin']:g}° "
            f"(p = {validation['equivalence_p']:.2g}); t test p = {validation['t_p']:.2g}."
        )
    if optimum:
        lines.append(
            f"The angle alone does not fix the parameters: every point of the solution set gives "
            f"{optimum['target']:.2f}°; the "
            f"point above is the one that the rule '{optimum['rule'].replace('_', ' ')}' chose."
        )
    verdict = _load(study / "diagnosis" / "verdict.json")
    if verdict:
        causes = ", ".join(verdict.get("causes", [])) or "no cause named"
        lines.append(f"Diagnosis of the measured data: {verdict['verdict']} ({causes}).")
    return lines


def _part(study, key, title, figures, tables):
    folder = study / key
    drawn = [
        _figure(folder / f"{name}.svg", caption)
        for name, caption in figures
        if (folder / f"{name}.svg").exists()
    ]
    shown = [
        _table(folder / f"{name}.csv", text)
        for name, text in tables
        if (folder / f"{name}.csv").exists()
    ]
    if not drawn and not shown:
        return None
    return {
        "key": key,
        "title": title,
        "texts": _texts(study, key),
        "figures": drawn,
        "tables": shown,
    }


def _figure(path, caption):
    svg = re.sub(r"^.*?(?=<svg)", "", path.read_text(), count=1, flags=re.S)
    # ids are unique only within their own file
    prefix = path.stem + "-"
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", svg)
    return {"svg": svg, "caption": (CAPTIONS / f"{caption}.rst").read_text().strip()}


def _table(path, title):
    frame = pd.read_csv(path)
    if "verdict" in frame:
        frame = frame.sort_values("verdict", key=lambda v: v != "disagrees", kind="stable")
    data = base64.b64encode(path.read_bytes()).decode()
    hidden = [c for c in frame if c in ("run_id", "experiment")]
    html = (
        frame.drop(columns=hidden)
        .head(SHOWN_ROWS)
        .to_html(index=False, border=0, float_format="%.4g", na_rep="")
    )
    return {
        "file": f"{path.parent.name}_{path.name}",
        "title": title,
        "data": data,
        "html": html,
        "open": len(frame) <= 20,
    }


def _texts(study, key):
    """Sentences that say a stage's outcome."""
    data = _load(study / key / f"{key}.json") or {}
    if key == "screening":
        found = ", ".join(data["significant"]).replace("_", " ") or "none"
        going = ", ".join(data["factors"]).replace("_", " ")
        return [f"Significant at p < {data['alpha']:g}: {found}. On to the ascent go: {going}."]
    if key == "ascent":
        angles = ", ".join(f"{a:.1f}" for a in data["responses"])
        return [
            f"Angles along the path: {angles}°. Point {data['step']} is nearest to the measured {data['target']:.2f}°."
        ]
    if key == "response_surface":
        s = data["statistics"]
        return [
            f"Angle = {data['equation_coded']} in coded levels.",
            f"R² {s['R2']:.3f}, adjusted {s['R2_adj']:.3f}, predicted {s['R2_pred']:.3f}; "
            f"CV {s['CV_percent']:.2f} %; adequate "
            f"precision {s['adequate_precision']:.1f}; lack of fit p = {s['lack_of_fit_p']:.2g}.",
        ]
    if key in ("tilt", "drop"):
        return [
            f"Measured {data['measured']:g} {data['unit']} gives {data['inverse']:.3f}; "
            f"runs there gave {data['confirmed_mean']:.2f} "
            f"{data['unit']}. {data['closed_form_of']} gives {data['closed_form']:.3f}."
        ]
    if key in ("shear", "scaling"):
        return [data["sentence"]] if key == "shear" else [x["sentence"] for x in data["statements"]]
    return []


def _diagnosis(study):
    folder = study / "diagnosis"
    verdict = _load(folder / "verdict.json")
    if not verdict:
        return None
    figures = [
        {
            "svg": re.sub(r"^.*?(?=<svg)", "", p.read_text(), count=1, flags=re.S),
            "caption": p.stem.replace("_", " "),
        }
        for p in sorted(folder.glob("*.svg"))
    ]
    texts = [f"Verdict: {verdict['verdict']}."] + [str(p) for p in verdict.get("patterns", [])]
    return {
        "key": "diagnosis",
        "title": "What the simulation gets wrong",
        "texts": texts,
        "figures": figures,
        "tables": [],
    }
