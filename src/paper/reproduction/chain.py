"""Tables 10 to 13 and Eq. 28: ascent, response surface, optimum and validation.

The paper's points, terms and optimum can be compared one by one only with a study of the paper's
three factors. The first study whose screening sent these on is taken.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy import stats

from calibration.chain.responses import with_value
from calibration.statistics.equivalence import Error, verdict
from calibration.statistics.surface import fit_surface
from calibration.statistics.validate import compare
from paper.reproduction import margins
from paper.reproduction.rows import (
    ALPHA,
    NOT_COMPARABLE,
    NOT_RUN,
    Place,
    absent,
    estimates,
    means,
    point,
    printed_of,
    spreads,
    within,
    words,
)

if TYPE_CHECKING:
    from paper.audit.paper import Paper
    from paper.reproduction.study import Study


NAMES = {
    # the paper's letters: factor
    "X": "salt_salt_rolling_friction",
    "Y": "salt_salt_restitution",
    "Z": "salt_steel_rolling_friction",
}
LETTERS = dict(zip("ABC", "XYZ", strict=True))  # Table 12 and Eq. 28 call X, Y, Z by A, B, C
STATISTICS = ("R2", "R2_adj", "R2_pred", "CV_percent", "adequate_precision")
DRAWS = 400


def rows(paper: Paper, studies: Sequence[Study]) -> Iterator[dict[str, Any]]:
    """Rows of the chain: the paper's points from a study of its factors, the validation of every
    study."""
    alike = [s for s in studies if set(s.region_names() or ()) == set(NAMES.values())]
    study = alike[0] if alike else None
    parts = (
        ("Table 10", "angles along the ascent", _ascent),
        ("Table 11", "angles of the Box-Behnken runs", _box_behnken),
        ("Eq. 28", "coefficients", _equation),
        ("3.1", "the paper's optimum", _optimum),
    )
    for item, what, part in parts:
        if study is None:
            sent = "; ".join(
                f"{s.name}: {', '.join(s.region_names() or ('not run',))}" for s in studies
            )
            place = Place(item, f"{item}.{what}", what, "deg")
            yield absent(place, None, NOT_COMPARABLE, f"no study of the paper's factors ({sent})")
        else:
            yield from part(paper, study)
    first = study or studies[0]
    yield from _statistics(paper, first)
    for one in studies:
        yield from _validation(paper, one)


def simulated_sd(paper: Paper) -> float:
    """Scatter of the paper's own runs at one point [deg]: standard deviation of the 25 angles of
    Table 13."""
    return float(paper.numbers("table13_validation", "angle_deg")["angle_deg"].std(ddof=1))


def spread(paper: Paper, study: Study) -> tuple[float | None, int | None, float]:
    """(our sd between seeds or None, runs it is from, the paper's sd between its runs) [deg]."""
    return *(study.seed_spread() or (None, None)), simulated_sd(paper)


def _ascent(paper, study):
    table = paper.numbers("table10_steepest_ascent", *NAMES, "angle_deg")
    runs = study.table("ascent", "runs")
    for k, text in enumerate(paper.printed("table10_steepest_ascent", "angle_deg")):
        place = Place(
            "Table 10", f"table10.level{k + 1}", f"angle at level {k + 1}", "deg", study.name
        )
        point = {NAMES[c]: table[c][k] for c in NAMES}
        here = _runs_at(runs, point)
        if here.empty:
            yield absent(place, text.text, NOT_COMPARABLE, "our path does not pass this point")
        else:
            yield _beside_one(place, text, here["response"], paper, study)


def _beside_one(place, text, values, paper, study):
    """The mean of our runs (n,) at a point beside the one run of the paper's table there."""
    (own, _, theirs), values = spread(paper, study), values.dropna()
    mean = float(values.mean()) if len(values) else math.nan
    return point(place, text, mean, own, len(values), theirs)


def _runs_at(runs, point):
    if runs is None or not set(point) <= set(runs):
        return pd.DataFrame()
    return runs[np.all([np.isclose(runs[c], v, atol=1e-6) for c, v in point.items()], axis=0)]


def _box_behnken(paper, study):
    coding = paper.numbers("table11_coding", "low", "centre", "high")
    table = paper.numbers("table11_box_behnken", *NAMES)
    runs, used = study.region_runs(), Counter()
    half = coding["high"] - coding["centre"]
    points = [
        {name: coding["centre"][i] + row[letter] * half[i] for i, (letter, name) in
            enumerate(NAMES.items())}
        for row in table.to_dict("records")
    ]  # fmt: skip
    printed = Counter(tuple(p.values()) for p in points)
    texts = paper.printed("table11_box_behnken", "angle_deg")
    for k, (levels, text) in enumerate(zip(points, texts, strict=True)):
        place = Place("Table 11", f"table11.run{k + 1}", f"angle of run {k + 1}", "deg", study.name)
        key = tuple(levels.values())
        # our runs at a point are shared out among the rows that the paper has there
        here = _runs_at(runs, levels).iloc[used[key] :: printed[key]]
        used[key] += 1
        if here.empty:
            yield absent(place, text.text, NOT_COMPARABLE, "not a point of our design")
        else:
            yield _beside_one(place, text, here["response"], paper, study)


def _surfaces(paper, study):
    """The paper's regression of Table 11 (its Box-Behnken levels) and ours, in the paper's letters
    A, B, C."""
    table = paper.numbers("table11_box_behnken", *NAMES, "angle_deg").rename(
        columns={x: a for a, x in LETTERS.items()}
    )
    theirs = fit_surface(table, list(LETTERS), table["angle_deg"])
    region = {f["name"]: f["code"] for f in study.summary("response_surface", "region")}
    runs = with_value(study.region_runs(), "response")
    ours = pd.DataFrame({a: runs[region[NAMES[x]]] for a, x in LETTERS.items()})
    return theirs, fit_surface(ours, list(LETTERS), runs["response"])


def _equation(paper, study):
    theirs, ours = _surfaces(paper, study)
    printed = dict(
        part.split(":") if ":" in part else ("Intercept", part)
        for part in paper.scalar_text("eq28_coefficients").split()
    )
    table, other = (s.coefficients.set_index("term") for s in (ours, theirs))
    for term in table.index:
        name = term.replace("²", "2")
        place = Place("Eq. 28", f"eq28.{name}", f"coefficient of {term}", "deg", study.name)
        mine, error = table.loc[term, ["estimate", "se"]]
        if name in printed:
            own = Error(error, ours.df, len(ours.diagnostics))
            yield estimates(place, printed_of(printed[name]), mine, own,
                Error(other.loc[term, "se"], theirs.df))  # fmt: skip
        else:
            yield absent(place, None, NOT_COMPARABLE, "the paper leaves this term out", ours=mine)


def _statistics(paper, study):
    """Fit statistics of our surface, whatever its factors, with intervals drawn from the fit. Where
    the design was repeated, each repeat is fitted alone, as the paper's, and the mean is shown."""
    runs, region = study.region_runs(), study.summary("response_surface", "region")
    table = paper.text("table12_summary", "statistic", "value")
    printed = dict(zip(table["statistic"], table["value"], strict=True))
    if runs is None or region is None:
        yield absent(
            Place("Table 12", "table12.statistics", "fit statistics"),
            None,
            NOT_RUN,
            "response_surface",
        )
        return
    runs, codes = with_value(runs, "response"), [f["code"] for f in region]
    repeats = [r for _, r in runs.groupby("replicate")]
    ours = [fit_surface(r, codes, r["response"]) for r in repeats]
    levels = paper.numbers("table11_box_behnken", *NAMES, "angle_deg")
    theirs = fit_surface(levels, list(NAMES), levels["angle_deg"])
    pairs = zip(repeats, ours, strict=True)
    draws = [_drawn(r, codes, fit, seed) for seed, (r, fit) in enumerate(pairs, 1)]
    their_draws = _drawn(levels, list(NAMES), theirs)
    names = {"R2": "R²", "R2_adj": "adjusted R²", "R2_pred": "predicted R²", "CV_percent": "CV"}
    for key in STATISTICS:
        unit = "%" if key == "CV_percent" else "1"
        place = Place(
            "Table 12", f"table12.{key}", names.get(key, "adequate "
            "precision"), unit, study.name, key != "R2_adj"
        )  # fmt: skip
        value = float(np.mean([fit.summary[key] for fit in ours]))
        reach = _reach(np.mean([d[key] for d in draws], axis=0), value)
        their_reach = _reach(their_draws[key], theirs.summary[key])
        basis = "90 % interval, both sides drawn from their fits and residuals"
        if len(ours) > 1:
            basis += f"; mean of {len(ours)} repeats of the design, each fitted alone"
        said = printed_of(printed[key])
        margin = margins.R2 if key.startswith("R2") else margins.SCATTER_SHARE * said.value
        yield within(place, said, value, reach, basis, margin, len(runs), their_reach)


def _reach(drawn, value):
    """(below, above) of the 90 % interval of a statistic from draws of it (n,)."""
    low, high = np.quantile(drawn, (ALPHA, 1.0 - ALPHA))
    return value - low, high - value


def _drawn(runs, codes, surface, seed=1):
    """Statistics (DRAWS,) each of surfaces fitted to responses drawn about `surface`."""
    rng, fitted = np.random.default_rng(seed), surface.predict(runs[codes].to_numpy(float))
    sd = float(np.sqrt(surface.sigma2))
    found = [
        fit_surface(runs, codes, fitted + rng.normal(0.0, sd, len(fitted))).summary
        for _ in range(DRAWS)
    ]
    return {key: np.array([f[key] for f in found]) for key in STATISTICS}


def _optimum(paper, study):
    """Our surface at the paper's optimum beside the paper's validated angle. It says whether that
    optimum is one of ours; the three coordinates are one point of a set and are not compared."""
    _, ours = _surfaces(paper, study)
    region = {f["name"]: f for f in study.summary("response_surface", "region")}
    at = [_coded(region[name], paper.value(f"optimum_{name}")) for name in NAMES.values()]
    angle = paper.scalar("validated_angle_of_repose")
    predicted = float(ours.predict(np.array([at]))[0])
    low, high = (float(x[0]) for x in ours.confirmation_interval([at], 25, 2 * ALPHA))
    place = Place(
        "3.1", "optimum.angle", "angle at the paper's optimum, by our surface", "deg", study.name,
        headline=True
    )  # fmt: skip
    reach = predicted - low, high - predicted
    sd, n = simulated_sd(paper), len(paper.numbers("table13_validation", "angle_deg"))
    their_reach = 2 * (float(stats.t.ppf(1 - ALPHA, n - 1)) * sd / np.sqrt(n),)
    basis = "90 % interval of the mean of 25 runs there, by our surface; Table 13 on the other side"
    yield within(place, angle, predicted, reach, basis, None, len(ours.diagnostics), their_reach)


def _coded(factor, level):
    return (level - 0.5 * (factor["low"] + factor["high"])) / (
        0.5 * (factor["high"] - factor["low"])
    )


def _validation(paper, study):
    found = study.summary("validation")
    if found is None:
        place = Place("Table 13", f"table13.{study.name}", "validated angle", "deg", study.name)
        yield absent(place, paper.scalar_text("validated_angle_of_repose"), NOT_RUN, "validation")
        return
    table = paper.numbers("table13_validation", "group", "replicate", "angle_deg")
    theirs = table.pivot(index="group", columns="replicate", values="angle_deg").to_numpy()
    place = Place(
        "Table 13",
        f"table13.mean.{study.name}",
        "validated angle of repose",
        "deg",
        study.name,
        True,
    )
    yield means(
        place, paper.scalar("validated_angle_of_repose"), found["simulated_mean"],
        found["simulated_sd"],
        found["simulated_n"], float(theirs.std(ddof=1)), theirs.size,
    )  # fmt: skip
    place = Place(
        "Table 13", f"table13.sd.{study.name}", "standard deviation of the validated angles", "deg",
        study.name, True
    )  # fmt: skip
    yield spreads(
        place, float(theirs.std(ddof=1)), theirs.size, found["simulated_sd"], found["simulated_n"]
    )
    yield _equivalence(paper, study, found, theirs)


def _equivalence(paper, study, found, theirs):
    """Simulated and measured angle by the equivalence test, in the paper's tables and in ours."""
    measured = paper.angles()["angle_deg"]
    margin = found["margin"]
    said = compare(theirs, measured.to_numpy(), margin).as_dict()
    name = f"simulated and measured angle within {margin:g} deg of each other"
    place = Place("3.2", f"validation.equivalence.{study.name}", name, "1", study.name, True)
    low, high = "equivalence_low", "equivalence_high"
    verdicts = [verdict(x[low], x[high], margin) for x in (said, found)]
    basis = " and ".join(
        f"{x['difference']:.2f} deg ({x[low]:.2f} to {x[high]:.2f})" for x in (said, found)
    )
    return words(place, *verdicts, f"{basis}: Tables 1 and 13, and ours; 90 % intervals")
