"""A verdict as a page of Markdown, for reading in two minutes."""

import math

import yaml

from calibration.figures import label
from calibration.intake.quantities import LEVERS, QUANTITIES
from calibration.statistics.numbers import fixed
from diagnosis import discrepancy

LEAST_GAIN = 0.05  # nats; a mechanism with less is told in one line
MEANING = {
    "adequate": "Nothing is missing that these data show.",
    "identified": "The data name what is missing.",
    "discovered": "A law that is not in the catalogue, or that has no name yet, is missing; the "
    "curve is below.",
    "ambiguous": "Something is missing, and these data do not tell which of several it is.",
    "error": "An error of the set-up or single rows explain what is off, and no law does.",
    "unexplained": "The model fails, and nothing in the catalogue mends it.",
}


def page(verdict):
    """The verdict in Markdown, for reading in two minutes."""
    lines = [
        "# Diagnosis",
        "",
        f"**Verdict: {verdict['verdict']}**{_causes(verdict)}. {MEANING[verdict['verdict']]}",
        "",
        f"{_capital(verdict['reason'])}. {_odds(verdict)}{_tests(verdict)}",
        "",
        "## What the calibrated model gets wrong",
        "",
        *([f"- {t['sentence']}" for t in verdict["patterns"]] or ["- No pattern along a lever."]),
        "",
        "![Residuals along each lever](residuals.svg)",
        "",
        *_discrepancy(verdict),
        *_remarks(verdict),
        *_laws(verdict),
        *_scatter(verdict),
        *_test(verdict),
        *_ranking(verdict),
        *_exclusion(verdict),
        *_parameters(verdict),
        *_refinement(verdict),
        *_gain(verdict),
        *_held_out(verdict),
        *_outcomes(verdict),
        *_steps(verdict),
        *_further(verdict),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _capital(text):
    return text[:1].upper() + text[1:]


def _causes(verdict):
    return f": {', '.join(label(c) for c in verdict['causes'])}" if verdict["causes"] else ""


def _tests(verdict):
    fit = verdict["lack_of_fit"]
    deviance = fit.get("deviance")
    tests = "" if deviance is None else f", and {deviance:.1f} of the tests without a value"
    return (
        f"The base model's chi-square is {fit['chi_square']:.1f} on {fit['freedom']:.1f} degrees "
        f"of freedom{tests}: "
        f"{_chance(fit['p'])} of data made by it look as bad. {_chance(verdict['family_p'])} of "
        f"them would bring up a "
        "mechanism as helpful as the best one here."
    )


def _odds(verdict):
    """How much better the best of the named mechanisms predicts what was left out."""
    causes = set(verdict["causes"])
    named = [r for r in verdict["ranking"] if causes.issuperset(r["mechanism"].split(" + "))]
    if verdict["verdict"] not in ("identified", "ambiguous") or not named:
        return ""
    best, tried = named[0], verdict.get("tried", 1)
    if best["gain"] <= LEAST_GAIN:
        return ""
    text = (
        f"Settings that were left out are predicted better with {label(best['mechanism'])} than "
        f"without: the odds are {odds(best['gain'])}"
    )
    if tried > 1:
        # each is as probable beforehand as any other, and one of them as probable as none
        shared = odds(best["gain"] - math.log(tried))
        text += f", and {shared} as one of {tried} models that were tried"
    return f"{text}. "


def odds(gain):
    """'400 to 1' for a gain in nats; two digits, and no more than a million."""
    if gain > math.log(1e6):
        return "more than 1,000,000 to 1"
    value = float(f"{math.exp(gain):.2g}")
    return f"{value:,.0f} to 1" if value >= 10.0 else f"{value:g} to 1"


def _chance(p):
    return f"{100 * p:.2g} %"


def _laws(verdict):
    """The curve of each law, in words, numbers and names."""
    lines = []
    for law in verdict.get("laws") or []:
        if law["sentence"]:
            lines += ["## A law that the data show", "", law["sentence"], ""]
            lines += _about(law)
    return lines


def _about(law):
    """What else is known of a law."""
    lines, held = [], law.get("held_out")
    if held and held["settings"]:
        lines += [
            f"Left-out inner levels are missed by {held['after']:.1f} standard "
            f"errors with it and by {held['before']:.1f} without.",
            "",
        ]
    if law.get("not_run"):
        lines += [law["not_run"], ""]
    if law["names"]:
        names = ", ".join(map(label, law["names"]))
        lines += [f"Mechanisms that fit as well as the best form: {names}.", ""]
    if law["forms"]:
        texts = [law.get("formulas", {}).get(f, f) for f in law["forms"]]
        lines += [f"Forms that fit: {'; '.join(texts)}.", ""]
    if law["rivals"]:
        told = ", ".join(r["words"] for r in law["rivals"] if "words" in r)
        lines += [f"Not told from it by these data: {told}.", ""]
    if len(law["values"]) > 1:
        head = " x ".join(law["state"])
        lines += [f"| {head} | {law['slot']} | 95 % band |", "|---|---|---|"]
        lines += [
            f"| {v['state']:.3g} | {v['value']:.4g} | {v['low']:.4g} to {v['high']:.4g} |"
            for v in law["values"][:: max(len(law["values"]) // 6, 1)]
        ]
        lines.append("")
    return lines + _keys((law.get("engine") or {}).get("keys"))


def _test(verdict):
    """The prediction that can fail."""
    test = verdict.get("test")
    if not test:
        return []
    lines = ["## A prediction that can fail", "", test["text"], ""]
    if test["rows"]:
        lines += [f"By the rows that were held out it is {test['outcome']}.", ""]
    return lines


def _keys(keys):
    """The keys of a run spec that switch a law on."""
    if not keys:
        return []
    flow = {"default_flow_style": True, "sort_keys": False, "width": math.inf}
    lines = [f"- `{k}: {yaml.safe_dump(v, **flow).strip()}`" for k, v in keys.items()]
    return ["A run spec has this law with the keys", "", *lines, ""]


def _scatter(verdict):
    """Errors that the stated spread does not hold, and single readings at odds."""
    lines = [f"- {e['sentence']}" for e in verdict.get("errors") or [] if e.get("sentence")]
    lines += [f"- {r['sentence']}" for r in verdict.get("rows") or [] if r.get("sentence")]
    lines += [
        f"- Errors {_between(s['of'])} in the {QUANTITIES[s['experiment']].words}: {_size(s)}."
        for s in verdict.get("scatter") or []
    ]
    return ["## Errors beyond the stated spread", "", *lines, ""] if lines else []


def _size(scatter):
    """A standard deviation in words; a share of the reading unless a unit is given."""
    unit = scatter.get("unit", "share")
    return f"{100 * scatter['sd']:.2g} %" if unit == "share" else f"{scatter['sd']:.2g} {unit}"


def _between(of):
    if of == "settings":
        return "from setting to setting"
    if of in LEVERS:
        return f"shared by all readings at one {LEVERS[of].words}"
    return f"from {of} to {of}"


def _ranking(verdict):
    """Mechanisms that help at all, best first."""
    lines = [
        "## Which mechanism would mend it",
        "",
        "The gain says how much better settings are predicted that were left out of the fit, in "
        "nats and as odds of a model with the mechanism against one without. In "
        f"{_chance(verdict['threshold_level'])} of data chance alone brings a mechanism to its own "
        f"threshold, and the best of all to {verdict['null_threshold_best']:.1f}, which decides.",
        "",
        "| mechanism | gain | odds | threshold | strength (95 % interval) |",
        "|---|---|---|---|---|",
    ]
    idle = []
    for r in verdict["ranking"]:
        if r["gain"] < LEAST_GAIN:
            idle.append(label(r["mechanism"]))
            continue
        strength = "; ".join(
            f"{s['value']:.3g} {s['unit']}".removesuffix(" 1")
            + f" ({s['low']:.3g} to {s['high']:.3g})"
            for s in r.get("strength", {}).values()
        )
        threshold = f"{r['null_threshold']:.1f}" if "null_threshold" in r else ""
        lines.append(
            f"| {label(r['mechanism'])} | {fixed(r['gain'], 1)} | {odds(r['gain'])} | {threshold} "
            f"| {strength} |"
        )
    if idle:
        lines += ["", f"No gain: {', '.join(idle)}."]
    return [*lines, "", "![Gain of each mechanism](ranking.svg)", ""]


def _exclusion(verdict):
    """How strong each mechanism and how steep each law can be at most."""
    lines, open_ = [], []
    for row in verdict.get("exclusion") or []:
        name = label(row["mechanism"]) if "mechanism" in row else _law_name(row)
        sides = [
            f"{side} {_amount(row[side], row['unit'])}"
            for side in ("below", "above")
            if row[side] is not None
        ]
        if sides:
            lines.append(f"| {name} | {row['of']} | {' and '.join(sides)} |")
        else:
            open_.append(name)
    head = ["## What these data exclude, at 95 %", "", "| | of | excluded |", "|---|---|---|"]
    out = [*head, *lines, ""] if lines else []
    if open_:
        out += [f"Nothing is excluded within the range that is tried: {', '.join(open_)}.", ""]
    return out


def _law_name(row):
    return f"{row['slot']} of {' and '.join(row['state']) or 'all settings alike'}"


def _amount(value, unit):
    return f"{100 * value:+.2g} %" if unit == "share" else f"{value:.3g} {unit}".removesuffix(" 1")


def _parameters(verdict):
    lines = ["## Calibrated parameters of the base model", "", *_coefficients(verdict)]
    lines += ["| parameter | value | 95 % interval | identified |", "|---|---|---|---|"]
    for c in verdict["calibration"].values():
        known = "yes" if c["identified"] else "no: the data leave the prior"
        interval = f"{fixed(c['low'], 3)} to {fixed(c['high'], 3)}"
        lines.append(f"| {c['words']} | {c['value']:.3f} | {interval} | {known} |")
    return [*lines, ""]


def _coefficients(verdict):
    found = verdict.get("coefficients")
    if not found:
        return []
    return [
        f"The data carry {found['carried']} of the {found['asked']} coefficients: so many "
        "directions of the parameters have half the prior's standard deviation at most.",
        "",
    ]


def _refinement(verdict):
    """How rough the emulators are where the data are."""
    found = verdict.get("refinement")
    if not found or not found["left"]:
        return []
    before = {(r["experiment"], r["mechanism"]): r["error"] for r in found["waves"][0]["left"]}
    runs = " and ".join(f"{w['runs']}" for w in found["waves"])
    lines = [
        "## Error of the emulators at the posterior mode",
        "",
        f"Over that of the measurement; from {found['share']:g} on an emulator is refined by "
        f"further runs near the mode. The waves made {runs} runs.",
        "",
        "| experiment | model | at first | now |",
        "|---|---|---|---|",
    ]
    for r in found["left"]:
        first = before.get((r["experiment"], r["mechanism"]))
        shown = "" if first is None else f"{first:.2g}"
        rough = "" if r["enough"] else ": too rough still"
        lines.append(
            f"| {r['experiment']} | {label(r['mechanism'])} | {shown} | {r['error']:.2g}{rough} |"
        )
    return [*lines, ""]


def _gain(verdict):
    g = verdict["gain"]
    if not g:
        return []
    low, high = g["held_out_rmse_difference_interval"]
    lines = [
        "## Gain of the extended model, with the real engine on left-out settings",
        "",
        *_nested(next((law.get("engine") for law in verdict.get("laws") or []), None)),
        f"Root mean square error in {g['rmse_unit']}: {g['held_out_rmse_before']:.2f} before, "
        f"{g['held_out_rmse_after']:.2f} after; difference {fixed(low, 2)} to {fixed(high, 2)} "
        f"(95 %), {g['settings']} settings{_lost(g)}.",
        "",
        "![Miss at each left-out setting](gain.svg)",
        "",
    ]
    lines += [f"- {m['sentence']}" for m in verdict.get("moved", {}).values()]
    return [*lines, ""]


def _nested(engine):
    """What was left out where the law is one of single contacts."""
    if not engine:
        return []
    lever = engine["left_out"]
    what = f"The levels of the {LEVERS[lever].words}" if lever else "Single settings"
    return [
        f"{what} were left out in turn ({engine['levels']}), and everything was fitted anew "
        f"without each.{_part(engine)}",
        "",
    ]


def _part(engine):
    """Which part of the settings was run, where that is not all."""
    run, all_ = engine.get("run"), engine.get("of")
    return "" if run == all_ else f" Of the {all_} settings {run} were run, spread over the levels."


def _lost(gain):
    """How many settings the gain is not of."""
    lost = gain.get("without_value")
    return f"; at {lost} more one of the models gives no value" if lost else ""


def _discrepancy(verdict):
    """The discrepancy along each lever, where nothing explains it."""
    found = verdict.get("discrepancy") or []
    lines = [f"- {_capital(text)}." for text in discrepancy.sentences(found)]
    for c in found:
        own, lever = QUANTITIES[c["experiment"]], LEVERS[c["lever"]]
        unit = "share of the prediction" if c["unit"] == "share" else c["unit"]
        lines += [
            "",
            f"| {lever.words} [{lever.unit or 1}] | {own.words}: measured less predicted "
            f"[{unit}] | 95 % band |",
            "|---|---|---|",
        ]
        lines += [
            f"| {at:.3g} | {value:+.3g} | {low:+.3g} to {high:+.3g} |"
            for at, value, low, high in zip(
                c["at"][::2], c["value"][::2], c["low"][::2], c["high"][::2], strict=True
            )
        ]
    return ["## The discrepancy over the levers", "", *lines, ""] if found else []


def _remarks(verdict):
    """What the table's rows cannot tell, by their lines."""
    lines = [f"- {text}" for text in verdict.get("remarks") or []]
    return ["## Remarks on the measurements", "", *lines, ""] if lines else []


def _held_out(verdict):
    """The rows that no fit has seen."""
    rows = verdict.get("held_out") or []
    head = ["## Rows that were held out", "", "| line | measured | base model | extended model |"]
    lines = [
        f"| {r['line']} | {r['measured']:.4g} ± {r['error']:.2g} | {_beside(r, 'before')} "
        f"| {_beside(r, 'after')} |"
        for r in rows
    ]
    return [*head, "|---|---|---|---|", *lines, ""] if rows else []


def _outcomes(verdict):
    """Tests that ended without a value, and how likely that was."""
    lines = [
        f"| {r['experiment']} at {_setting(r['levers'])} | {r['failed']} of {r['tests']} "
        f"| {_chance_of(r['before'])} | {_chance_of(r['after'])} |"
        for r in verdict.get("outcomes") or []
        if r["failed"]
    ]
    head = [
        "## Tests that ended without a value",
        "",
        "| test | how many | expected by the base model | by the extended model |",
        "|---|---|---|---|",
    ]
    return [*head, *lines, ""] if lines else []


def _chance_of(chance):
    return "" if chance is None else _chance(chance)


def _setting(levers):
    return ", ".join(
        f"{LEVERS[k].words} {v:g} {LEVERS[k].unit}".rstrip() for k, v in levers.items()
    )


def _beside(row, label):
    if row[label] is None:
        return ""
    return f"{row[label]:.4g} ({fixed(row['miss_' + label], 1, '+')} standard errors)"


def _steps(verdict):
    """Whether half the time step would have changed anything."""
    lines = []
    for row in verdict.get("time_step") or []:
        quantity = QUANTITIES[row["experiment"]]
        text = (
            f"- {_capital(quantity.words)}: {row['change']:+.2g} ± {row['uncertain']:.1g} "
            f"{quantity.unit} of {row['value']:.3g}, {abs(row['change']) / row['error']:.2g} "
            "standard errors of the measurement"
        )
        lines.append(text + (": take a finer step." if row["matters"] else "."))
    return ["## What half the time step changes", "", *lines, ""] if lines else []


def _further(verdict):
    n = verdict["next_measurement"]
    if not n:
        return []
    quantity = QUANTITIES[n["experiment"]]
    levers = {k: v for k, v in n["levers"].items() if v is not None}
    lines = [
        "## The measurement that would tell most",
        "",
        f"{_capital(quantity.words)} at {_setting(levers)}: {n['information_bits']:.2f} bits.",
        "",
    ]
    return lines + [
        f"- {label(name)} expects {p['value']:.3g} ± {p['sd']:.2g} {quantity.unit}"
        for name, p in n["predictions"].items()
    ]
