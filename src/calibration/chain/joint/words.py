"""What a posterior says, of one test or of several, in sentences."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calibration.figures import label, response_of
from calibration.statistics.numbers import fixed

if TYPE_CHECKING:
    from calibration.figures import Response


TOGETHER = 0.4  # correlation from which on two parameters are said to go together
TELLS = 0.9  # of today's standard deviation: a measurement that leaves more tells little
DIAGNOSIS = (
    "the stage diagnose tells which, from three measured rows on where one test was made at two "
    "settings, such as two drop heights or two normal stresses; made at one setting each, measure "
    "one of them at another setting"
)


def sentences(summary: Mapping[str, Any], response: Response) -> list[str]:
    """What came out, for the report."""
    said = [*_bounded(summary), *_borders(summary), *_contradictions(summary)]
    said += [*_together(summary), *_targets(summary["targets"], len(summary["targets"]) > 1)]
    return [*said, *_next(summary), *_doubts(summary)]


def kinds(summary: Mapping[str, Any]) -> dict[str, list[str]]:
    """{kind: parameters} of a mapping of joint.json: bounded by the targets, narrowed by them,
    known beforehand and no better, open, and those that press on a border of the region."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for name, p in summary["parameters"].items():
        told = "bounded" if p["bounded"] else "narrowed"
        untold = "known" if name in summary.get("priors", {}) else "open"
        kind = told if p["left"] <= TELLS else untold
        found["border" if p["border"] else kind].append(name)
    return found


def _bounded(summary):
    level = f"{100 * summary['level']:.0f} %"
    heads = {
        "bounded": f"With {level} probability",
        "known": "Known beforehand, and no better from the targets",
        "narrowed": "Narrowed, but not bounded within the levels",
        "open": "The targets do not narrow",
    }
    intervals = {name: p["interval"] for name, p in summary["parameters"].items()}
    found = kinds(summary)
    said = {}
    for kind in heads:
        ends = summary["box"] if kind == "open" else intervals
        each = (f"{label(n)} {ends[n][0]:.3g} to {ends[n][1]:.3g}" for n in found[kind])
        said[kind] = ", ".join(each)
    return [f"{heads[kind]}: {words}." for kind, words in said.items() if words]


def _borders(summary):
    return [
        f"Move or widen the region: {label(name)} presses on its {p['border']} border, "
        f"{summary['box'][name][0 if p['border'] == 'low' else 1]:.3g}; its draws are "
        f"{p['interval'][0]:.3g} to {p['interval'][1]:.3g}, and {_fall(p)}."
        for name, p in summary["parameters"].items()
        if p["border"]
    ]


def _together(summary):
    """Which parameters hang together."""
    names, rows = list(summary["parameters"]), summary["correlation"]
    found = [
        f"{label(names[i])} and {label(names[j])} ({rows[i][j]:+.2f})"
        for i in range(len(names))
        for j in range(i)
        if abs(rows[i][j]) >= TOGETHER
    ]
    if not found:
        return []
    return [
        f"The parameters are not free of each other; correlated are {', '.join(found)}. Take a row "
        "of draws.csv, not one end of each interval."
    ]


def _fall(parameter):
    """Where the draws would fall off beyond the border."""
    if not parameter["reach_is_limit"]:
        return f"fall off near {parameter['reach']:.3g}"
    side = "least" if parameter["border"] == "low" else "most"
    return f"have not fallen off at {parameter['reach']:.3g}, the {side} that is possible"


def against(summary: Mapping[str, Any]) -> list[str]:
    """What of the targets speaks against the model: a contradiction between them, and each one of
    which all others expect another value. Of a mapping of joint.json."""
    named = _contradictions(summary) if summary["agreement"]["contradicts"] else []
    return [*named, *_targets([t for t in summary["targets"] if not t["agrees"]], others=True)]


def _contradictions(summary):
    found = summary["agreement"]
    if not found["contradicts"]:
        return [f"One set of parameters meets all targets (p = {found['p']:.2g})."]
    names, p = [_of_name(n) for n in found["named"]], f"p = {found['p']:.2g}"
    if len(names) > 1:
        return [
            f"No parameters of the region meet all targets ({p}). They contradict each other: "
            f"{'; '.join(names)}. Without any one of these the others agree. A law may be missing, "
            f"or a measurement may be wrong: {DIAGNOSIS}."
        ]
    contradicts = "contradicts the others" if found["p_without"] else "is beyond them"
    return [
        f"No parameters of the region meet all targets ({p}). {_capital(names[0])}, "
        f"{contradicts}. A law may be missing, or this measurement may be wrong: {DIAGNOSIS}."
    ]


def _targets(targets, others):
    """others: whether there are others that expect something of each."""
    said = []
    for target in targets:
        shown = response_of(target["metric"])
        by_others = (
            f", by the others a pull of {fixed(target['pull_others'], 1, '+')} "
            f"(p = {target['p_others']:.2g})"
        )
        said.append(
            f"{_capital(_test(target['rig'], target['metric']))}: measured "
            f"{shown.value(target['measured'])}, predicted {shown.value(target['predicted'])} "
            f"(pull {fixed(target['pull'], 1, '+')}){by_others if others else ''}."
        )
    if said:
        said.append("A pull is the measured less the predicted value, in standard deviations.")
    return said


def _test(rig, metric):
    """What a rig measures, as a reader calls it: "vessel, poured density"."""
    return f"{label(rig)}, {response_of(metric).name}"


def _of_name(name):
    """`_test` of a response's name, `vessel: poured_density_kg_m3`."""
    rig, _, metric = name.partition(": ")
    return _test(rig, metric)


def _capital(words):
    return words[:1].upper() + words[1:]


def _next(summary):
    rows = summary["next_test"]
    if not rows:
        return []
    best = rows[0]
    left = {k.removesuffix(" left"): v for k, v in best.items() if k.endswith(" left")}
    name, share = min(left.items(), key=lambda pair: pair[1])
    test = _test(best["rig"], best["metric"])
    head = f"{test}, {summary['readings']} readings in {best['hours']:g} h"
    of = "what is predicted" if name == "prediction" else label(name)
    if share > TELLS:
        return [
            f"No test is expected to tell much: the best, {head}, leaves {100 * share:.0f} % of "
            f"{of}."
        ]
    return [
        f"The test to make next: {head}, {best['nat_per_hour']:.2f} nat an hour. It is expected to "
        f"leave {100 * share:.0f} % of the spread of {of}. A nat is a unit of information: one nat "
        "leaves 37 % of what is open."
    ]


def _doubts(summary):
    said = [
        f"{count} runs of {_of_name(name)}, gave no value; parameters at which that is likely "
        "are less probable."
        for name, count in summary["without_value"].items()
        if count
    ]
    sampler = summary["sampler"]
    if not sampler["converged"]:
        said.append(
            f"The sampler's chains are short: they are worth {sampler['effective']:.0f} "
            "independent draws. The ends of the intervals are uncertain."
        )
    return said
