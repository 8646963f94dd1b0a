"""verdict.json: what the diagnosis found, in one documented mapping, with remarks on what the
settings of a table cannot tell and its tests that ended without a value."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
from scipy.special import expit

from calibration.intake.quantities import levers_of
from diagnosis import residuals
from diagnosis.bulk import Bulk, place_of
from diagnosis.chance import log_sum
from diagnosis.fit import Fit
from diagnosis.laws.readings import unread
from diagnosis.measurements import Measured
from diagnosis.model import Model
from diagnosis.next_measurement import best_of
from diagnosis.page import words
from diagnosis.residuals import calibration, moved, residual_rows
from diagnosis.rig import combine
from diagnosis.rules import NAMED
from diagnosis.settings import BASE, lever_values
from diagnosis.table_model.found import Found, give_strengths
from diagnosis.table_model.law import limits

SCHEMA = Path(__file__).with_name("verdict.schema.json")
CARRIED = 0.25  # variance left of the prior's, along a direction of the parameters, at most
RIVALS = 4
LEAST_SHARE = 0.01  # probability of a strength below which it takes no part


def of_found(found: Found, alpha: float) -> dict[str, Any]:
    """The keys of verdict.json that a `Found` gives, but for gain and limits.

    alpha: chance of a false alarm that was allowed."""
    decided, blocks = found.decided.keys(), found.selection.blocks
    return decided | {
        "misfit": found.misfit,
        "laws": found.laws,
        "errors": found.errors,
        "rows": found.rows,
        "next_measurement": found.next_setting,
        "gain": None,
        "discrepancy": [] if decided["verdict"] in words.WITHOUT else residuals.curves(blocks),
        "family_p": found.p,
        "threshold_level": alpha,
        "null_threshold_best": found.selection.threshold,
        "ranking": found.ranking,
    }


def base(bulk: Bulk, p: float) -> dict[str, Any]:
    """The base model fitted to a table of simulated tests: calibration, lack_of_fit and residuals.
    p: chance of its misfit."""
    fitted = bulk.fitted
    rows = residual_rows(
        bulk.measurements, predicted=fitted.expected[0], sd=fitted.sd[0],
        reading_sd=bulk.data.error[0], standardised=fitted.residual[0],
    )  # fmt: skip
    # the chi-square of the readings, and beside it the deviance of tests without a value
    out = {"chi_square": float(fitted.chi_square[0]), "freedom": float(fitted.freedom[0])}
    if fitted.deviances.size:
        out["deviance"] = float(fitted.deviances.sum())
    return {
        "calibration": calibration(bulk.base, fitted),
        "lack_of_fit": out | {"p": p},
        "residuals": rows,
    }


def findings(bulk: Bulk, found: Found, names: Sequence[str], alpha: float) -> dict[str, Any]:
    """The mapping without its gain, of a table of simulated tests; names: of `extension`."""
    catalogue = bulk.emulated.catalogue
    out = of_found(found, alpha) | base(bulk, found.misfit["p"])
    out["misfit"] = out["lack_of_fit"]
    out["coefficients"] = {
        "asked": len(bulk.base.names), "carried": carried(bulk.base, bulk.fitted)
    }  # fmt: skip
    strong = give_strengths(found, catalogue)
    for row in found.laws:
        row["sentence"] = _told(row, strong[row["key"]], catalogue)
    out["next_measurement"] = None if out["verdict"] == "unexplained" else _next(bulk, found)
    model, likeliest = bulk.fit(names)
    out["exclusion"] = limits(found.selection.blocks, catalogue)
    if names:
        out["calibration_extended"] = calibration(model, likeliest)
        out["moved"] = moved(out["calibration"], out["calibration_extended"])
    return out


def carried(model: Model, fitted: Fit) -> int:
    """Number of coefficients that the data carry: directions of the parameters along which their
    Fisher information leaves at most a quarter of the prior's variance, half its standard
    deviation."""
    left = fitted.cov[0] / np.outer(model.prior_sd, model.prior_sd)
    return int((np.linalg.eigvalsh(left) <= CARRIED).sum())


def extension(bulk: Bulk, found: Found) -> tuple[str, ...]:
    """Mechanisms of the model to extend to: of each law that was found the likeliest, of the
    strongest law alone where the engine cannot have all at once; none without a law."""
    if found.verdict not in NAMED:
        return ()
    names = tuple(
        dict.fromkeys(
            row["names"][0] if row["names"] else found.likeliest[row["key"]] for row in found.laws
        )
    )
    together = [bulk.emulated.catalogue[n] for n in names]
    return names if combine(bulk.emulated.settings, together, bulk.conditions) else names[:1]


def _told(row, strong, catalogue):
    """A sentence on what acts in a place, with its strength where it has one name or is a free
    law."""
    free = [(catalogue[name], s) for name, s in strong.items() if catalogue[name].changes]
    law, s = free[0] if len(strong) == 1 and free else (None, None)
    return "" if len(row["names"]) == 1 else words.told("acts.j2", row=row, law=law, s=s)


def _next(bulk, found):
    """The measurement that separates the best mechanism of each place that is left, and the base
    model unless it has been refuted; None with fewer than two of these."""
    refuted, catalogue = found.verdict in NAMED, bulk.emulated.catalogue
    near = [r for law in found.laws for r in (law, *law["rivals"]) if "slot" in r]
    places = {(r["slot"], tuple(r["state"])) for r in near}
    names = [r["mechanism"] for r in found.ranking]
    known = [catalogue[n] for n in bulk.emulated.applicable(bulk.conditions)]
    placed = [n for n in names if place_of(catalogue[n], known) in places]
    names = (placed if refuted and len(placed) > 1 else names)[:RIVALS]
    names += [] if refuted else [BASE]
    if len(names) < 2:
        return None
    gains = {r["mechanism"]: r["gain"] for r in found.ranking} | {BASE: 0.0}
    gain = np.array([gains[n] for n in names])
    # equal weights among causes that count as not told apart
    weight = np.exp(np.clip(gain - gain.max(), -3.0, 0.0))
    return best_of(*_expected(bulk, names), weight)


def _expected(bulk, names):
    """Settings, names, means and standard deviations (r, k) of the logarithm that the models with
    each of r mechanisms expect there, BASE being none, and the usual errors (k,). The settings are
    at the ends and the middle of each lever."""
    settings, beside = [], []
    for m in {m.experiment: m for m in bulk.measurements}.values():
        ranges = bulk.emulated.settings.experiments[m.experiment].levers
        ends = [(low, float(f"{np.sqrt(low * high):.3g}"), high) for low, high in ranges.values()]
        for values in product(*ends):
            levers = dict(zip(ranges, values, strict=True))
            whole = lever_values(bulk.emulated.settings, m.experiment, levers) | levers
            settings.append((m.experiment, whole, {}))
            beside.append(unread(m, levers=levers, batch="", instrument=""))
    [block] = Bulk(bulk.emulated, bulk.tested, beside=beside).block().values()
    at = np.argsort(block.readings.rows)[-len(settings) :]
    told = [_with(block, name) for name in names]
    means, variances = (np.array(v)[:, at] for v in zip(*told, strict=True))
    return settings, names, means, np.sqrt(variances), block.readings.usual[at]


def _with(block, name):
    """Means and variances (n,) of the logarithms with a mechanism in the block, over its strengths
    and what the readings say of these; without one where the block has none of that name."""
    found = [(t, s) for t in block.terms.values() for s in t.shapes if s.name == name]
    if not found:  # it is none, or does not show
        return block.expected()
    [(term, shape), *_] = found
    odds, parts = block.by_strength(shape), []
    share = np.exp(odds - log_sum(odds))
    for k in np.flatnonzero(share > LEAST_SHARE):
        one = replace(shape, label=shape.label[[k]], root=shape.root[[k]], mean=shape.mean[[k]])
        held = block.holding(term.key, replace(term, shapes=(one,)))
        parts.append((share[k], *held.expected()))
    share, means, variances = map(np.array, zip(*parts, strict=True))
    share /= share.sum()
    mean = share @ means
    return mean, share @ (variances + means**2) - mean**2


def validate(verdict: Mapping[str, Any]) -> None:
    """Raise jsonschema.ValidationError where the mapping does not follow verdict.schema.json."""
    jsonschema.validate(verdict, json.loads(SCHEMA.read_text()))


def remarks(
    measured: Measured,
    counted: Collection[str] = (),
    errors: Sequence[Mapping[str, Any]] = (),
) -> list[str]:
    """Sentences, each with its lines, on what a `Measured` table cannot tell; counted: experiments
    whose tests without a value entered the fits; errors: of the emulators, of which a mechanism has
    none where most of its runs gave no value."""
    kinds = [
        _Kind(kind, [m for m in measured.fitted if m.experiment == kind], measured.singly.get(kind))
        for kind in dict.fromkeys(m.experiment for m in measured.fitted)
    ]
    text = words.environment().get_template("remarks.j2").render(
        kinds=kinds,
        outcomes=[m for m in measured.outcomes if m.experiment not in counted],
        untrained=[row for row in errors if "error" not in row],
        lines=_lines,
    )  # fmt: skip
    return [line for line in text.splitlines() if line]


class _Kind:
    """An experiment's measurements, levels of its levers, rows whose batch or instrument is alone,
    readings that are alone in their condition, columns that differ within a setting, and what its
    readings go with."""

    def __init__(self, kind, own, goes_with):
        self.kind, self.own, self.goes_with = kind, own, goes_with
        count = {n: len({m.levers[n] for m in own if n in m.levers}) for n in levers_of(kind)}
        self.single = max(count.values(), default=0) < 2
        self.two = [name for name, levels in count.items() if levels == 2]
        self.alone = [(name, m) for name in ("batch", "instrument") for m in own if getattr(m, name)
                      and sum(getattr(o, name) == getattr(m, name) for o in own) == 1]  # fmt: skip
        self.lone = [m for m in own if len(m.readings) == 1 and not goes_with]
        self.pooled = {name: [m for m in own if name in m.pooled]
                       for name in dict.fromkeys(n for m in own for n in m.pooled)}  # fmt: skip


def of_outcomes(bulk: Bulk, models: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """[{experiment, levers, tests, failed, before, after}] of the conditions whose tests ended
    without a value or with one: the chance of none by models {before or after: names of
    mechanisms}, null without one."""
    chance = {}
    for label, names in models.items():
        model, fitted = bulk.fit(names)
        chance[label] = expit(model.odds(fitted.theta[:1])[0][0])
    rows = []
    for i, (experiment, levers) in enumerate(bulk.tests):
        row = {"experiment": experiment, "levers": levers, "tests": int(bulk.data.tests[i])}  # type: ignore[index]
        row["failed"] = int(bulk.data.failed[0, i])  # type: ignore[index]
        row |= {k: float(chance[k][i]) if k in chance else None for k in ("before", "after")}
        rows.append(row)
    return rows


def _lines(rows):
    lines = [str(m.line) for m in rows if m.line is not None]
    return f"Line{'s' * (len(lines) > 1)} {', '.join(lines)}" if lines else "A setting"
