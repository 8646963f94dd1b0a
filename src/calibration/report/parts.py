"""The stages of the chain as sections of the page: their outcome in words, figures, tables and data."""

import pandas as pd

from calibration.figures import label, quantity_of
from calibration.report.embed import caption, download, figure, load, signed, table

# stage folder: title, [(figure, its caption's file, files with its numbers)], [(table, title)]
STAGES = {
    "screening": (
        "Screening",
        [
            ("half_normal", "half_normal", ["effects.csv"]),
            ("pareto", "pareto", ["effects.csv"]),
        ],
        [("runs", "Design and results"), ("effects", "Effects"), ("anova", "Analysis of variance")],
    ),
    "ascent": (
        "Steepest ascent",
        [("path", "ascent", ["runs.csv"])],
        [("runs", "Path and results")],
    ),
    "response_surface": (
        "Response surface",
        [
            ("surfaces", "surfaces", ["coefficients.csv"]),
            ("predicted_actual", "predicted_actual", ["diagnostics.csv"]),
            ("residuals", "residuals", ["diagnostics.csv"]),
            ("perturbation", "perturbation", ["coefficients.csv"]),
        ],
        [
            ("runs", "Design and results"),
            ("anova", "Analysis of variance"),
            ("coefficients", "Coefficients, in coded levels"),
            ("diagnostics", "Residuals and influence"),
        ],
    ),
    "optimise": (
        "Optimum",
        [("contours", "contours", ["solution_set.csv", "optimum.json"])],
        [("solution_set", "Points of the solution set")],
    ),
    "validation": (
        "Validation",
        [("validation", "validation", ["runs.csv", "validation.json"])],
        [("runs", "Replicates")],
    ),
    "tilt": ("Bench test: tilted plane", [("tilt", "tilt", ["runs.csv"])], [("runs", "Runs")]),
    "drop": ("Bench test: drop", [("drop", "drop", ["runs.csv"])], [("runs", "Runs")]),
    "shear": (
        "Bench test: direct shear",
        [("yield_locus", "shear", ["runs.csv", "shear.json"])],
        [("runs", "Runs")],
    ),
}
# folder: title, what it says
BESIDE = {
    "scaling": (
        "Scaling of the particles",
        "What coarser particles change, and which rule keeps what.",
    ),
    "reproduction": (
        "This study beside the paper",
        "Each printed result of the paper beside ours.",
    ),
    "numerics": (
        "What the numerical choices cost",
        "Difference that resolution, time step, stiffness and rolling law make, with its 95 % interval: a choice whose "
        "interval holds zero, or that stays within the spread from seed to seed, does not matter here.",
    ),
    "audit": (
        "The paper's arithmetic",
        "Every printed figure and statement, recomputed from the paper's own tables; disagreements come first.",
    ),
}

# columns of a table beside the chain that are only in its data
UNSHOWN = {
    "scaling": ("sd", "left_in_funnel"),
    "reproduction": ("id", "headline", "study", "n", "low", "high"),
    "audit": ("id",),
}
ALL_ROWS = 10_000  # a table of verdicts is shown whole, in a box that scrolls


def stage(study, key, quantity):
    """The section of a stage, or None where it has not run."""
    title, figures, tables = STAGES[key]
    folder = study / key
    drawn = [
        figure(folder / f"{name}.svg", caption(text), [folder / d for d in data])
        for name, text, data in figures
        if (folder / f"{name}.svg").exists()
    ]
    shown = [
        table(folder / f"{name}.csv", text)
        for name, text in tables
        if (folder / f"{name}.csv").exists()
    ]
    drawn += _further(folder, [name for name, *_ in figures])
    if not drawn and not shown:
        return None
    summary = load(folder / f"{key}.json")
    texts = SENTENCES[key](summary, quantity) if summary and key in SENTENCES else []
    return {"key": key, "title": title, "texts": texts, "figures": drawn, "tables": shown}


def _further(folder, listed):
    """Figures of further targets, <figure>_<metric>.svg or <metric>.svg, with the files that bear the metric."""
    figures = []
    for path in sorted(p for p in folder.glob("*.svg") if p.stem not in listed):
        base = next((n for n in listed if path.stem.startswith(f"{n}_")), None)
        metric = path.stem.removeprefix(f"{base}_")
        text = f"{quantity_of(metric).name.capitalize()}: {caption(base or folder.name)}"
        data = sorted(p for p in folder.glob(f"*{metric}*") if p.suffix != ".svg")
        figures.append(figure(path, text, [*data, folder / "runs.csv"]))
    return figures


def beside(study, key):
    """The section of what stands beside the chain, made of whatever tables, figures and data its folder holds."""
    folder, (title, text) = study / key, BESIDE[key]
    figures = sorted(folder.glob("*.svg"))
    tables = [p for p in sorted(folder.glob("*.csv")) if p.name not in ("design.csv", "runs.csv")]
    if not figures and not tables:
        return None
    numbers = [p for p in sorted(folder.glob("*.json")) if p.name != "plan.json"]
    return {
        "key": key,
        "title": title,
        "texts": [text, *_counts(tables)],
        "figures": [figure(p, _named(key, p), [*tables, *numbers]) for p in figures],
        "tables": [_beside_table(p, UNSHOWN.get(key, ())) for p in tables],
        "downloads": [] if figures else [download(p) for p in numbers],
    }


def _beside_table(path, unshown):
    title, first = label(path.stem).capitalize(), ("verdict", "disagrees")
    return table(path, title, first, ALL_ROWS, unshown) | {"open": True}


def _counts(tables):
    """How many rows of a table of verdicts have which."""
    sentences = []
    for path in tables:
        frame = pd.read_csv(path)
        judged = [column for column in ("verdict", "agreement") if column in frame]
        for column in judged:
            found = frame[column].value_counts()
            words = ", ".join(f"{n} {_verb(label(str(word)), n)}" for word, n in found.items())
            sentences.append(f"{len(frame)} in all: {words}.")
    return sentences


def _verb(word, n):
    """A verdict behind its number: 1 agrees, 2 agree."""
    return word.removesuffix("s") if n != 1 and word.endswith("agrees") else word


def _named(key, path):
    """Caption of a figure that is not listed above: the file of that name, or its name in plain words."""
    return caption(f"{key}_{path.stem}") or caption(path.stem) or label(path.stem).capitalize()


def diagnosis(study):
    """The section of the diagnosis, or None."""
    folder = study / "diagnosis"
    verdict = load(folder / "verdict.json")
    if not verdict:
        return None
    reason = verdict.get("reason", "").strip().rstrip(".")
    texts = [f"Verdict: {verdict['verdict']}{_causes(verdict)}{': ' if reason else ''}{reason}."]
    texts += [p["sentence"] if isinstance(p, dict) else str(p) for p in verdict.get("patterns", [])]
    following = verdict.get("next_measurement")
    if following:
        levers = ", ".join(f"{label(k)} {v:.3g}" for k, v in following.get("levers", {}).items())
        texts.append(
            f"The measurement that would tell most next: {following['experiment']}, {levers}."
        )
    figures = [
        figure(p, _named("diagnosis", p), [folder / "verdict.json"])
        for p in sorted(folder.glob("*.svg"))
    ]
    return {
        "key": "diagnosis",
        "title": "What the calibrated model gets wrong",
        "texts": texts,
        "figures": figures,
        "tables": [table(p, label(p.stem).capitalize()) for p in sorted(folder.glob("*.csv"))],
        "downloads": [download(folder / "verdict.json")],
    }


def _causes(verdict):
    causes = " and ".join(label(c) for c in verdict.get("causes", []))
    return f" ({causes})" if causes else ""


def _screening(data, quantity):
    found = ", ".join(label(n) for n in data["significant"]) or "none"
    going = ", ".join(label(n) for n in data["factors"])
    return [f"Significant at p < {data['alpha']:g}: {found}. On to the ascent go: {going}."]


def _ascent(data, quantity):
    path = ", ".join(quantity.value(v) for v in data["responses"])
    return [
        f"Along the path: {path}. Point {data['step']} comes nearest to the measured "
        f"{quantity.value(data['target'])} and becomes the centre of the response surface."
    ]


def _surface(data, quantity):
    s = data["statistics"]
    return [
        f"{quantity.name.capitalize()} = {data['equation_coded']} in coded levels.",
        f"R² {s['R2']:.3f}, adjusted {s['R2_adj']:.3f}, predicted {s['R2_pred']:.3f}; CV {s['CV_percent']:.2f} %; "
        f"adequate precision {s['adequate_precision']:.1f}; lack of fit p = {s['lack_of_fit_p']:.2g}.",
    ]


def _validation(data, quantity):
    further = [
        f"{quantity_of(metric).name.capitalize()}: {_difference(found, quantity_of(metric))}"
        for metric, found in data.get("further", {}).items()
        if "difference" in found
    ]
    return [_difference(data, quantity), *_groups(data), *further]


def _groups(data):
    """Whether the values of all groups may count as independent; nothing where it could not be tested."""
    if data.get("groups_p") is None:
        return []
    test = f"(F test between groups, p = {data['groups_p']:.2g})"
    if data["groups_differ"]:
        return [
            f"The groups differ {test}: their values are not independent, the interval is too narrow."
        ]
    return [
        f"The groups do not differ {test}, so that all {data['simulated_n']} values count as independent."
    ]


def _difference(data, quantity):
    word = "equivalent" if data["equivalent"] else "not shown to be equivalent"
    return (
        f"Difference {signed(data['difference'])}{quantity.unit} (95 % {signed(data['difference_low'])} to "
        f"{signed(data['difference_high'])}); {word} within ±{data['margin']:g}{quantity.unit} "
        f"(p = {data['equivalence_p']:.2g}); t test p = {data['t_p']:.2g}."
    )


def _sweep(data, quantity):
    unit = "°" if data["unit"] == "deg" else f" {data['unit']}"
    return [
        f"The measured {data['measured']:g}{unit} gives {data['inverse']:.3f}; runs there gave "
        f"{data['confirmed_mean']:.2f}{unit}. {data['closed_form_of']} gives {data['closed_form']:.3f}."
    ]


SENTENCES = {
    "screening": _screening,
    "ascent": _ascent,
    "response_surface": _surface,
    "validation": _validation,
    "tilt": _sweep,
    "drop": _sweep,
    "shear": lambda data, quantity: [data["sentence"]],
}
