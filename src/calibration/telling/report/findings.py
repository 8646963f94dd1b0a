"""The three sentences that matter, made from the results: what decides, what stays open, what is
wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calibration.chain.joint.words import against
from calibration.chain.optimum import given_nowhere, out_of_reach
from calibration.chain.posterior_words import following, known
from calibration.chain.study import Results
from calibration.chain.validation import judged
from calibration.figures import label, response_of
from calibration.intake.tables import read_written
from calibration.statistics.numbers import difference_of, fixed, signed
from calibration.telling.report.known import (
    POOR,
    of_one_test,
    posterior_of,
    said_by_diagnosis,
)

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from calibration.figures import Response


WIDE = 0.9  # of the region searched: a parameter that the target leaves open


def findings(study: Path, response: Response) -> list[tuple[str, str]]:
    """[(heading, text)] for the page's first screen; only what the study's files hold."""
    screening = Results(study).summary("screening", "screening")
    optimum = Results(study).summary("optimise", "optimum")
    region = Results(study).summary("response_surface", "region")
    found = []
    effects = _effects(study)
    if screening and effects is not None:
        found.append(("What decides", decides(effects, screening, response)))
    posterior = posterior_of(Results(study))
    others, _ = of_one_test(study, response)
    decide = f"The other tests that were given decide: {'; '.join(others)}." if others else None
    if posterior:
        text = f"{known(posterior)} {decide or following(posterior, response)}"
        found.append(("What stays open", text.strip()))
    elif optimum and region:
        found.append(("What stays open", stays_open(optimum, region, response, decide or DECIDES)))
    if screening or optimum:
        predicted = second_experiments(Results(study), response)
        wrong = [
            *_judged(study, response),
            *(_missed(row) for row in predicted if not row["within"]),
            *_of_all_tests(study),
        ]
        wrong = wrong or ["Nothing that was measured and simulated speaks against them."]
        met = [_met(row) for row in predicted if row["within"]]
        found.append(("What is wrong", " ".join([*wrong, *met])))
        odd = [*_screened(screening, response), *_fitted(study)]
        if odd:
            found.append(("What to know of the runs", " ".join(odd)))
    return found


def _effects(study):
    """The screening's table of effects, the largest first; None where it has not run."""
    path = study / "screening" / "effects.csv"
    table = read_written(path) if path.exists() else None
    if table is None or not {"name", "effect"} <= set(table):
        return None
    return table.sort_values("effect", key=abs, ascending=False)


def decides(effects: pd.DataFrame, screening: Mapping[str, Any], response: Response) -> str:
    """The largest effect with its share of the screening's scatter, and the other significant
    ones."""
    first = effects.iloc[0]
    share = (
        f", {first['contribution_percent']:.0f} % of what the screening's heaps differ by"
        if "contribution_percent" in effects
        else ""
    )
    text = (
        f"{_name(first['name'])} decides: {_effect(first['effect'], response)} over its "
        f"range{share}."
    )
    others = [n for n in screening["significant"] if n != first["name"]]
    sizes = dict(zip(effects["name"], effects["effect"], strict=True))
    if others:
        named = ", ".join(f"{_between(n)} ({_effect(sizes[n], response)})" for n in others)
        return f"{text} Also significant: {named}."
    return f"{text} No other effect is significant at p < {screening['alpha']:g}."


DECIDES = "Another measurement (drop, tilted plane, shear) decides between the points."


def stays_open(
    optimum: Mapping[str, Any],
    region: Sequence[Mapping[str, Any]],
    response: Response,
    decides: str = DECIDES,
) -> str:
    """The parameters that the target does not fix within the region searched; decides: the sentence
    that says which tests fix them."""
    if given_nowhere(optimum):
        return f"{out_of_reach(optimum, response)} So it bounds no parameter."
    borders = {f["name"]: (f["low"], f["high"]) for f in region}
    parts, fixed = [], []
    for name, (low, high) in optimum["solution_set"].items():
        first, last = borders.get(name, (low, high))
        if last > first and high - low >= WIDE * (last - first):
            parts.append(f"{_between(name)} ({low:.3g} to {high:.3g}, all of the region searched)")
        else:
            fixed.append(f"{_between(name)} to {low:.3g} to {high:.3g}")
    target = response.value(optimum["target"])
    if not parts:
        return f"{target} bounds every parameter: {', '.join(fixed)}."
    bound = f"; it bounds {', '.join(fixed)}" if fixed else ""
    return f"{target} alone leaves {' and '.join(parts)} open{bound}. {decides}"


def _screened(screening, response):
    """The largest effect that was left out, where others went on that are smaller."""
    if not screening:
        return []
    effects, on = screening.get("effects", {}), screening["factors"]
    left = {n: e for n, e in effects.items() if n not in on}
    if not left:
        return []
    largest = max(left, key=lambda n: abs(left[n]))
    smaller = [n for n in on if n in effects and abs(effects[n]) < abs(left[largest])]
    if not smaller:
        return []
    than = " and ".join(f"{_between(n)} ({_effect(effects[n], response)})" for n in smaller)
    return [
        f"{_name(largest)} ({_effect(left[largest], response)}) is not calibrated, though it moves "
        f"the response more than {than}: {_why(screening, smaller)}."
    ]


def _why(screening, names):
    """Why these went on, each reason once."""
    why = screening.get("why", {})
    reasons = dict.fromkeys(why.get(n, "the configured path prefers it") for n in names)
    return ", ".join(NAMED if reason.startswith("named by") else reason for reason in reasons)


NAMED = "the configuration names what is calibrated (screening.go_on)"


def _fitted(study):
    """Odd points, lack of fit, and a surface that predicts little."""
    surface = Results(study).summary("response_surface", "response_surface")
    if not surface:
        return []
    found = []
    for odd in surface.get("outliers", []):
        found.append(
            f"Run {odd['run']} of the response surface lies {odd['studentised']:.1f} standard "
            f"deviations off the surface; up to {surface['outlier_limit']:.1f} is expected."
        )
    s = surface["statistics"]
    lack, predicted = s.get("lack_of_fit_p"), s.get("R2_pred")
    if lack is not None and lack < 0.05:
        found.append(f"The surface does not follow the heaps (lack of fit p = {lack:.2g}).")
    if predicted is not None and predicted < POOR:
        found.append(f"The surface predicts little (predicted R² {fixed(predicted, 2)}).")
    return found


def _judged(study, response):
    """What validation and diagnosis object to."""
    v, found = Results(study).summary("validation", "validation"), []
    if v and not v["equivalent"]:
        apart, low, high = difference_of(v)
        within = f"±{v['margin']:g}{response.unit}"
        said = f"The validated heaps differ by {apart}{response.unit} (95 % {low} to {high})"
        # a small difference that is known badly is no fault of the parameters
        found.append(
            f"{said}: {v['simulated_n']} heaps and the readings are too few to show that they are "
            f"equivalent within {within}. More heaps would tell (validation.replicates)."
            if abs(v["difference"]) < v["margin"]
            else f"{said}: {judged(v, response.unit)}."
        )
    verdict = Results(study).summary("diagnosis", "verdict")
    if verdict and verdict["verdict"] != "adequate":
        found += said_by_diagnosis(verdict)
    return found


def second_experiments(results: Results, response: Response) -> list[Mapping[str, Any]]:
    """The rows of push_through.json of a folder's `Results` that have a measured value of another
    metric than the calibrated one: what the calibrated grains give in another machine, beside it.
    The draws of one target come first."""
    return [
        row
        for stage in ("push_through", "joint_push_through")
        for row in (results.summary(stage) or {}).get("metrics", [])
        if row["measured"] is not None and response_of(row["metric"]) != response
    ]


def _missed(row):
    metric = response_of(row["metric"])
    apart = 100.0 * (row["mean"] - row["measured"]) / abs(row["measured"])
    return (
        f"{_expected(row, metric)}. The second experiment is missed by {abs(apart):.1f} %: a law "
        "may be missing, the grains may have another shape or size, or a measurement may be wrong."
    )


def _met(row):
    return f"{_expected(row, response_of(row['metric']))}: the second experiment is met."


def _expected(row, metric):
    """A row of a second experiment in words, without its end."""
    machine = label(row["machine"])
    return (
        f"{machine[:1].upper()}{machine[1:]}, {metric.name}: measured "
        f"{metric.value(row['measured'])}, and a further run of the calibrated grains lies between "
        f"{metric.value(row['low'])} and {metric.value(row['high'])} (95 %)"
    )


def _of_all_tests(study):
    """What the joint posterior objects to: targets that contradict each other, and values of this
    page that all tests together leave out."""
    results = Results(study)
    found, optimum = results.summary("joint"), results.summary("optimise", "optimum")
    if not found:
        return []
    return [
        *against(found),
        *(_outside(found["parameters"], optimum["optimum"]) if optimum else []),
    ]


def _outside(parameters, optimum):
    """Calibrated values outside the intervals of all tests together."""
    parts = []
    for name, value in optimum.items():
        low, high = parameters[name]["interval"] if name in parameters else (value, value)
        if not low <= value <= high:
            parts.append(f"{_between(name)} {value:.3g} (all tests: {low:.3g} to {high:.3g})")
    if not parts:
        return []
    return [
        f"The values of this page meet one target; all tests together ask for others: "
        f"{', '.join(parts)}."
    ]


def _between(name):
    """A factor's name in a sentence: what two grains do is `between grains`."""
    return re.sub(r" of (\w+) on \1$", " between grains", label(name))


def _name(name):
    return _between(name)[0].upper() + _between(name)[1:]


def _effect(value, response):
    return f"{signed(value)}{response.unit}"
