"""Tables 6, 7, 10 to 13 and Eq. 28: screening, ascent, response surface, optimum and validation.

The screenings of the same study at other seeds count as repeats of its runs. Both sides ran the
same rows, so that an effect carries the same interactions in both, and the scatter between seeds
alone is the error of their difference.

The paper's points, terms and optimum can be compared one by one only with a study of the paper's
three factors. The first study whose screening sent these on is taken.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from calibration.chain.responses import with_value
from calibration.statistics.equivalence import ALPHA, Error, compare, verdict
from calibration.statistics.screening import screen
from calibration.statistics.surface import fit_surface, pure_error
from paper.audit.paper import FACTORS, NAMES, TABLES, Paper, levels, printed_number
from paper.audit.screening import screened
from paper.audit.surface import printed_equation, regression, restored_levels
from paper.reproduction import rows as r
from paper.reproduction.rows import Place
from paper.reproduction.study import Study

CODES = list(FACTORS)
DESIGN = "table06_plackett_burman"
LETTERS = dict(zip("ABC", NAMES.values(), strict=True))
"""What Table 12 and Eq. 28 call X, Y and Z: factor."""
STATISTICS = {
    "R2": "R²",
    "R2_adj": "adjusted R²",
    "R2_pred": "predicted R²",
    "CV_percent": "CV",
    "adequate_precision": "adequate precision",
}
DRAWS = 400
DESIGNED = "Table 6", "table06.run{}", "angle of run {}", "this study ran another design"
ASCENT = "Table 10", "table10.level{}", "angle at level {}", "our path does not pass this point"
REGION = "Table 11", "table11.run{}", "angle of run {}", "not a point of our design"


def rows(paper: Paper, studies: Sequence[Study]) -> Iterator[dict[str, Any]]:
    """Rows of the chain: the screening of the first study, the paper's points from a study of its
    factors, the validation of every study."""
    yield from _screening(paper, studies[0])
    alike = [s for s in studies if {f["name"] for f in s.region or ()} == set(NAMES.values())]
    study = alike[0] if alike else None
    if study is not None:
        own = (study.seed_spread() or (None,))[0]
        for table, runs in ((ASCENT, study.table("ascent", "runs")), (REGION, study.region_runs())):
            yield from _points(paper, study, runs, levels(paper, table[0]), own, *table)
        yield from _equation(paper, study)
        yield from _optimum(paper, study)
    else:
        own = ((s.name, ", ".join(f["name"] for f in s.region or ())) for s in studies)
        names = "; ".join(f"{name}: {region or 'not run'}" for name, region in own)
        reason = f"no study of the paper's factors ({names})"
        for item, what in (
            ("Table 10", "angles along the ascent"),
            ("Table 11", "angles of the Box-Behnken runs"),
            ("Eq. 28", "coefficients"),
            ("3.1", "the paper's optimum"),
        ):
            yield r.row(Place(item, f"{item}.{what}", what, "deg"), reason)
    yield from _statistics(paper, study or studies[0])
    for one in studies:
        yield from _validation(paper, one)


def simulated_sd(paper: Paper) -> tuple[float, int]:
    """Scatter of the paper's own runs at one point: standard deviation [deg] of the angles of Table
    13, and how many they are."""
    angles = paper.numbers("table13_validation", "angle_deg")["angle_deg"]
    return float(angles.std(ddof=1)), len(angles)


def _screening(paper, study):
    """Rows of Tables 6 and 7."""
    runs, summary = study.table("screening", "runs"), study.summary("screening")
    if runs is None or summary is None:
        for place in (("Table 6", "table06", "screening runs"), ("Table 7", "table07", "effects")):
            yield r.row(Place(*place), "screening", agreement=r.NOT_RUN)
        return
    more = [own_half(s.table("screening", "runs")) for s in study.repeats]
    runs = own_half(runs)
    every = [runs, *(t for t in more if t is not None and _alike(t, runs))]
    at, (sd, freedom) = paper.numbers(DESIGN, *CODES), _scatter(study, every)
    ran = pd.concat(every, ignore_index=True)
    yield from _points(paper, study, ran if _alike(runs, at) else None, at, sd, *DESIGNED)
    yield from _effects(paper, study, ran, sd, freedom)


def own_half(runs: pd.DataFrame | None) -> pd.DataFrame | None:
    """The runs of the configured table, without those of a foldover, which the paper has not; None
    for None."""
    return runs if runs is None or "fold" not in runs else runs[runs["fold"] == 1]


def _alike(runs, first):
    """Return whether both tables ran the same rows."""
    there = set(CODES) <= set(runs) & set(first) and len(runs) == len(first)
    return there and np.allclose(runs[CODES], first[CODES])


def _scatter(study, every):
    """(our standard deviation between seeds [deg], its degrees of freedom): from the repeats, else
    from the validation."""
    if len(every) == 1:
        own, n = study.seed_spread() or (None, None)
        return own, None if n is None else n - 1
    valued = with_value(pd.concat(every, ignore_index=True))
    square, freedom = pure_error(valued[CODES].to_numpy(float), valued["response"].to_numpy())
    return math.sqrt(square / freedom), freedom


def _effects(paper, study, ran, sd, freedom):
    names = paper.text("table05_contact_parameter_ranges").set_index("factor")["name"]
    effects = study.table("screening", "effects").set_index("code")
    theirs = screened(paper).table.set_index("code")["effect"]
    runs = with_value(ran)
    own = [c for c in CODES if c in effects.index and effects.loc[c, "name"] == names[c]]
    ours = screen(runs, own, runs["response"]).table.set_index("code") if own else None
    inverse = np.linalg.inv(np.cov(runs[own].T, bias=True).reshape(len(own), len(own)))
    # of the paper's effects, by the scatter between its runs, that of Table 13
    paper_sd, paper_n = simulated_sd(paper)
    their_error = Error(2.0 * paper_sd / math.sqrt(len(paper.text(DESIGN))), paper_n - 1)
    for code in CODES:
        words = f"effect of {r.said(names[code])}"
        place = study.place("Table 7", f"table07.{code}.effect", words, "deg", True)
        if code not in own or ours is None:
            yield r.row(place, "no factor of this study")
            continue
        printed, mine = _rounded(theirs[code]), float(ours.loc[code, "effect"])
        if sd is None:
            yield r.row(place, "our spread is not known", printed.text, mine)
            continue
        # of an effect, which is twice a slope; the columns are not orthogonal where a run is lost
        k = own.index(code)
        error = 2.0 * sd * math.sqrt(inverse[k, k] / len(runs))
        yield r.estimates(place, printed, mine, Error(error, freedom, len(runs)), their_error)


def _rounded(effect):
    """An effect to the two places of the angles, a half rounded away from zero. Printed decimals
    make halves often, and a computed one is off by its last digits, so it is read to twelve digits
    first."""
    number = Decimal(f"{float(effect):.12g}").quantize(Decimal("0.01"), ROUND_HALF_UP)
    return printed_number(f"{number:f}")


def _points(paper, study, runs, at, own, item, name, what, lacking):
    """Rows of a table's points, at: the mean of our runs at each, which scatter by own, beside the
    one run of the paper. Our runs at a point are shared out among the rows that the paper has
    there."""
    printed, used, theirs = Counter(map(tuple, at.to_numpy())), Counter(), simulated_sd(paper)[0]
    for k, text in enumerate(paper.printed(TABLES[item].file, "angle_deg")):
        place = study.place(item, name.format(k + 1), what.format(k + 1), "deg")
        key = tuple(at.iloc[k])
        known = runs is not None and set(at) <= set(runs)
        here = runs_at(runs, dict(at.iloc[k])) if known else pd.DataFrame()
        here = here.iloc[used[key] :: printed[key]]
        used[key] += 1
        if here.empty:
            yield r.row(place, lacking, text.text)
        else:
            yield r.point(place, text, here["response"], own, theirs)


def runs_at(runs: pd.DataFrame, point: Mapping[str, float]) -> pd.DataFrame:
    """The runs of a table at a point, {column: level}."""
    return runs[np.all([np.isclose(runs[c], v, atol=1e-6) for c, v in point.items()], axis=0)]


def _surface(study):
    """Our regression of the region's runs in the paper's letters A, B, C."""
    region = {f["name"]: f["code"] for f in study.region}
    runs = with_value(study.region_runs())
    ours = pd.DataFrame({a: runs[region[name]] for a, name in LETTERS.items()})
    return fit_surface(ours, list(LETTERS), runs["response"])


def _equation(paper, study):
    theirs, ours = regression(paper), _surface(study)
    printed = printed_equation(paper)
    table, other = (s.coefficients.set_index("term") for s in (ours, theirs))
    for term in table.index:
        name = term.replace("²", "2")
        place = study.place("Eq. 28", f"eq28.{name}", f"coefficient of {term}", "deg")
        mine, error = table.loc[term, ["estimate", "se"]]
        name = "1" if term == "Intercept" else name
        if name in printed:
            own = Error(error, ours.df, len(ours.diagnostics))
            their_own = Error(other.loc[term, "se"], theirs.df)
            yield r.estimates(place, printed[name], mine, own, their_own)
        else:
            yield r.row(place, "the paper leaves this term out", ours=mine)


def _statistics(paper, study):
    """Fit statistics of our surface, whatever its factors, with intervals drawn from the fit. Where
    the design was repeated, each repeat is fitted alone, as the paper's, and the mean is shown."""
    runs, region = study.region_runs(), study.region
    if runs is None or region is None:
        place = Place("Table 12", "table12.statistics", "fit statistics")
        yield r.row(place, "response_surface", agreement=r.NOT_RUN)
        return
    table = paper.text("table12_summary", "statistic", "value")
    printed = dict(zip(table["statistic"], table["value"], strict=True))
    runs, codes = with_value(runs), [f["code"] for f in region]
    repeats = [one for _, one in runs.groupby("replicate")]
    ours = [fit_surface(one, codes, one["response"]) for one in repeats]
    pairs = zip(repeats, ours, strict=True)
    draws = [_drawn(one, codes, fit, seed) for seed, (one, fit) in enumerate(pairs, 1)]
    theirs, design = regression(paper), pd.DataFrame(restored_levels(paper), columns=list(LETTERS))
    their_draws = _drawn(design, list(LETTERS), theirs)
    basis = "90 % interval, both sides drawn from their fits and residuals"
    if len(ours) > 1:
        basis += f"; mean of {len(ours)} repeats of the design, each fitted alone"
    for key, name in STATISTICS.items():
        unit = "%" if key == "CV_percent" else "1"
        place = study.place("Table 12", f"table12.{key}", name, unit, key != "R2_adj")
        value = float(np.mean([fit.summary[key] for fit in ours]))
        reach = r.reach(np.mean([d[key] for d in draws], axis=0), value)
        their_reach = r.reach(their_draws[key], theirs.summary[key])
        said = printed_number(printed[key])
        margin = r.R2_MARGIN if key.startswith("R2") else r.SCATTER_SHARE * said.value
        yield r.within(place, said, value, reach, basis, margin, len(runs), their_reach)


def _drawn(runs, codes, surface, seed=1):
    """Statistics (DRAWS,) each of surfaces fitted to responses drawn about `surface`."""
    rng, fitted = np.random.default_rng(seed), surface.predict(runs[codes].to_numpy(float))
    sd = float(np.sqrt(surface.sigma2))
    drawn = (fitted + rng.normal(0.0, sd, len(fitted)) for _ in range(DRAWS))
    return pd.DataFrame([fit_surface(runs, codes, y).summary for y in drawn])


def _optimum(paper, study):
    """Our surface at the paper's optimum beside the paper's validated angle. It says whether that
    optimum is one of ours; the three coordinates are one point of a set and are not compared."""
    ours, at = _surface(study), []
    region = {f["name"]: f for f in study.region}
    for name in NAMES.values():
        low, high = region[name]["low"], region[name]["high"]
        at.append((paper.value(f"optimum_{name}") - 0.5 * (low + high)) / (0.5 * (high - low)))
    predicted = float(ours.predict(np.array([at]))[0])
    low, high = (float(x[0]) for x in ours.confirmation_interval([at], 25, 2 * ALPHA))
    text = "angle at the paper's optimum, by our surface"
    place = study.place("3.1", "optimum.angle", text, "deg", headline=True)
    reach = predicted - low, high - predicted
    sd, n = simulated_sd(paper)
    their_reach = 2 * (float(stats.t.ppf(1 - ALPHA, n - 1)) * sd / np.sqrt(n),)
    basis = "90 % interval of the mean of 25 runs there, by our surface; Table 13 on the other side"
    angle = paper.scalar("validated_angle_of_repose")
    yield r.within(place, angle, predicted, reach, basis, None, len(ours.diagnostics), their_reach)


def _validation(paper, study):
    found, name = study.summary("validation"), study.name
    angle = paper.scalar("validated_angle_of_repose")
    if found is None:
        place = study.place("Table 13", f"table13.{name}", "validated angle", "deg")
        yield r.row(place, "validation", angle.text, agreement=r.NOT_RUN)
        return
    table = paper.numbers("table13_validation", "group", "replicate", "angle_deg")
    theirs = table.pivot(index="group", columns="replicate", values="angle_deg").to_numpy()
    their_sd = float(theirs.std(ddof=1))
    mean, sd, n = (found[f"simulated_{of}"] for of in ("mean", "sd", "n"))
    place = study.place(
        "Table 13", f"table13.mean.{name}", "validated angle of repose", "deg", True
    )
    yield r.means(place, angle, mean, sd, n, their_sd, theirs.size)
    text = "standard deviation of the validated angles"
    place = study.place("Table 13", f"table13.sd.{name}", text, "deg", True)
    yield r.spreads(place, their_sd, theirs.size, sd, n)
    # simulated and measured angle by the equivalence test, in the paper's tables and in ours
    margin, low, high = found["margin"], "equivalence_low", "equivalence_high"
    said = compare(theirs, paper.angles()["angle_deg"].to_numpy(), margin)
    text = f"simulated and measured angle within {margin:g} deg of each other"
    place = study.place("3.2", f"validation.equivalence.{name}", text, headline=True)
    verdicts = [verdict(x[low], x[high], margin) for x in (said, found)]
    basis = " and ".join(
        f"{x['difference']:.2f} deg ({x[low]:.2f} to {x[high]:.2f})" for x in (said, found)
    )
    yield r.words(place, *verdicts, f"{basis}: Tables 1 and 13, and ours; 90 % intervals")
