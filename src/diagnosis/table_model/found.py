"""What the model of a whole table says: what is wrong, where, and by which cause."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from calibration.intake.measurements import Measurement
from calibration.intake.quantities import LEVERS, QUANTITIES
from diagnosis.catalogue import Mechanism
from diagnosis.chance import share_above
from diagnosis.laws.readings import FREE, from_log, readings_of
from diagnosis.laws.slots import GIVEN
from diagnosis.measurements import LEAST_SETTINGS
from diagnosis.next_measurement import propose_setting, words_of
from diagnosis.page.words import capital, sentence, told
from diagnosis.rules import OPEN, Evidence, Verdict, by_readings
from diagnosis.table_model import selection as chosen
from diagnosis.table_model.block import (
    ERROR,
    LAW,
    ROW,
    Block,
    KnownCurves,
    Shape,
    Term,
    judged,
    without_row,
)
from diagnosis.table_model.law import BAND, curve, named, strength_limits, unit_of
from diagnosis.table_model.terms import rounded_off

MISFIT = 0.01
"""Chance of the misfit of constant coefficients below which a table is never adequate."""

DOES_NOT_FIT = 3.0
"""Root mean square miss of left-out inner levels, in all errors that a law states for itself, above
which no mechanism is named and no formula told: none that was tried fits."""

SURE = 0.95  # probability that an error of a declared batch or instrument is there, to be told
LEAST_ROWS = 3
LEAST_BITS = 0.1  # that a reading at a setting must tell of what is in question, for it to be asked
SCATTER = {"of": "settings", "what": "settings", "words": "error from setting to setting"}


@dataclass
class Found:
    """The parts of verdict.json that the model gives; see src/diagnosis/verdict.schema.json.

    likeliest: {key of a law: form or mechanism that fits best in its place}; scattered: the misfit
    of what was found with errors from setting to setting, where it does not pass without; decided:
    the verdict, empty before `judge` gives it."""

    misfit: dict
    laws: list
    errors: list
    rows: list
    ranking: list
    next_setting: dict | None
    selection: chosen.Selection = field(repr=False)
    likeliest: dict = field(default_factory=dict, repr=False)
    scattered: dict | None = None
    decided: Verdict = OPEN

    @property
    def verdict(self) -> str:
        """The word of the verdict."""
        return self.decided.verdict

    @property
    def causes(self) -> list[str]:
        """The mechanisms that the verdict names."""
        return list(self.decided.causes)

    @property
    def p(self) -> float:
        """Chance of the first step."""
        return self.selection.p

    def block_of(self, key: str) -> Block:
        """The block that has a term."""
        return next(b for b in self.selection.blocks.values() if key in b.terms)


def discover(
    measurements: Sequence[Measurement],
    known: KnownCurves | None = None,
    alpha: float = 0.05,
    seed: int = 0,
    defaults: Mapping[str, Mapping[str, float]] | None = None,
    chance: Sequence[int] = chosen.CHANCE,
    aside: Sequence[dict[str, Any]] = (),
) -> Found | None:
    """`Found` of the measurements of drops, slides and shear tests; None where there are none.

    known: a function of `Readings` that gives the catalogue's curves; defaults: {experiment:
    {lever: value}} where rows leave a lever empty; aside: rows of readings that were set aside."""
    kinds = [k for k in FREE if sum(m.experiment == k for m in measurements) >= LEAST_ROWS]
    if not kinds:
        return None
    parts = [readings_of(measurements, k, (defaults or {}).get(k)) for k in kinds]
    out = judge(placed(chosen.blocks_of(parts, known), measurements, aside, alpha, seed, chance))
    out.next_setting = _next(out)
    return out


def placed(
    start: dict[str, Block],
    measurements: Sequence[Measurement],
    aside: Sequence[dict[str, Any]],
    alpha: float,
    seed: int,
    chance: Sequence[int],
) -> Found:
    """`Found` of blocks {name: Block} without a term held, its verdict left open and no further
    setting proposed; aside: rows of readings that were set aside."""
    misfit = chosen.misfit(_replicated(start), seed, chance[0])
    found = chosen.select(start, alpha, seed, chance)
    left = chosen.misfit(found.blocks, seed, chance[-1])
    ranking = _ranking(start, found)
    out = Found(misfit, [], [], list(aside), ranking, None, found)
    for block in found.blocks.values():
        for key in block.held:
            _add(out, measurements, block, key)
        out.errors += _not_held(measurements, block, misfit["p"], left["p"])
    if left["p"] < MISFIT:
        out.scattered = chosen.misfit(found.blocks, seed, chance[-1], scatter=True)
        _in_question(out, measurements)
        _first_suspect(out, measurements, seed, chance[-1])
    for rows in (out.laws, out.errors):
        rows.sort(key=lambda r: -abs(r["evidence"]))
    out.rows.sort(key=lambda r: -abs(r["standard_deviations"]))
    return out


def _replicated(blocks):
    """The blocks without terms, by the errors that replicates show: what rounding takes off is an
    error of the set-up and no part of a fit that is adequate."""
    return {
        name: replace(b, readings=replace(b.readings, error=b.readings.own), terms={}, held={})
        for name, b in blocks.items()
    }


def _add(out, measurements, block, key):
    """The row of a held term, in its list."""
    term, steps = block.terms[key], out.selection.steps
    if term.kind == ROW:
        out.rows.append(_row(measurements, block, key))
        return
    near = chosen.rivals(block, key)
    p = next((s.p for s in steps if s.key == key), steps[-1].p)
    own = chosen.strength_of(block, key), p, [_rival(measurements, block, r) for r in near]
    row = _head(block, key, *own) | {"set_anew": _set_anew(measurements, block, key, near)}
    if term.kind == LAW:
        out.laws.append(row | _law(block, key, out))
    else:
        out.errors.append(_told(row | _error(block, key)))
        _instead(out, measurements, block, key, near)


def _head(block, key, evidence, p, rivals, **more):
    """What the rows of laws and errors begin with."""
    row = {"experiment": block.terms[key].experiment, "key": key, **more}
    return row | {"evidence": evidence, "p": p, "rivals": rivals}


def _instead(out, measurements, block, key, near):
    """The likeliest law in place of an error that is not told from it, as a law of its own."""
    best = next((r for r in near if block.terms[r.key].kind == LAW), None)
    if best is None or any(row["key"] == best.key for row in out.laws):
        return
    law = best.key
    other = chosen.held_in_turn(block.without(key), (law, best.beside, law))
    others = [chosen.Rival(key, 0.0), *(r for r in near if r.key != law)]
    near = [_rival(measurements, block, r) for r in others]
    known = chosen.strength_of(other, law), out.p, near
    row = _head(other, law, *known, instead_of=key) | _law(other, law, out)
    if best.beside:
        row["sentence"] += f" {capital(_wrong_level(block, best))} would then be set wrongly."
    out.laws.append(row)


def _wrong_level(block, rival):
    """The level that a rival takes to be set wrongly, in words."""
    lever = LEVERS[block.terms[rival.beside].of]
    return f"the {lever.words} of {rival.level} {lever.unit}"


def _in_question(out, measurements):
    """The best law that chance alone could have made, where nothing else is placed, a misfit is
    left, and the law is not told from an error from setting to setting either: by odds, or because
    the settings are few."""
    stopped, said = out.selection.stopped, [e for e in out.errors if e["what"] != "declared"]
    if stopped is None or out.laws or out.rows or any(e["what"] != "settings" for e in said):
        return
    block = out.block_of(stopped.key)
    least = chosen.LEAST if _is_of_few(block, stopped.key) else chosen.ODDS
    if block.terms[stopped.key].kind != LAW or stopped.evidence < least:
        return
    key, held = stopped.key, block.holding(stopped.key)
    kind = block.terms[key].experiment
    rivals = [SCATTER | {"experiment": kind, "behind": -stopped.evidence}]
    rivals += [_rival(measurements, held, r) for r in chosen.rivals(held, key)]
    known = stopped.evidence, stopped.p, rivals
    row = _head(held, key, *known, instead_of=f"{kind}:settings")
    out.laws.append(row | _law(held, key, out))


def _first_suspect(out, measurements, seed, count):
    """The row that explains more than an error from setting to setting, and alone all of the
    misfit, where nothing else is placed: few settings do not tell the two apart."""
    if out.laws or out.rows or any(e["what"] not in ("declared", "settings") for e in out.errors):
        return
    blocks, best = out.selection.blocks, (0.0, "", "")
    for name, block in blocks.items():
        values = chosen.evidences(block, block.y[None])
        rows = [(float(v[0]), name, k) for k, v in values.items() if block.terms[k].kind == ROW]
        best = max([best, *rows], key=lambda row: row[0])
    evidence, name, key = best
    held = blocks | {name: blocks[name].holding(key)} if evidence > 0.0 else {}
    if held and chosen.misfit(held, seed, count)["p"] >= MISFIT:
        out.rows.append(_row(measurements, held[name], key))


def _is_of_few(block, key):
    """Return whether the experiments that show a law have fewer than LEAST_SETTINGS."""
    return block.terms[key].more.get("settings", len(block.readings.log)) < LEAST_SETTINGS


def _rival(measurements, block, rival):
    term = block.terms[rival.key]
    words = words_of(term)
    if rival.beside:
        words += f", with {_wrong_level(block, rival)} set wrongly"
    out = {"experiment": term.experiment, "behind": rival.behind, "words": words}
    out |= {"level": rival.level} if rival.level else {}
    if term.kind == LAW:
        return out | {"slot": term.place[0], "state": list(term.place[1])}
    if term.kind == ERROR:
        return out | {"of": term.of, "what": term.what}
    return out | {"line": measurements[block.readings.rows[term.rows[0]]].line}


def _set_anew(measurements, block, key, near):
    """Return what the evidence alone tells from a held term, with a sentence, or None."""
    other = chosen.set_anew(block, key)
    if other is None or any(r.key == other.key for r in near):
        return None
    lever = LEVERS[next(t.of for t in (block.terms[key], block.terms[other.key]) if t.of)]
    row = _rival(measurements, block, other) | {"key": other.key}
    return row | {"sentence": told("by_evidence.j2", row=row, lever=lever)}


def _law(block, key, out):
    term, law = block.terms[key], block.terms[key].law
    slot, state = term.place
    own, out.likeliest[key] = named(block, key)
    # a form that fits as well is a formula and no other cause
    single = own["names"][0] if len(own["names"]) == 1 else None
    row = {"slot": slot, "state": list(state), **own, "single": single}
    row |= {"band": BAND, "values": [], "gain": None, "unit": "1"}
    row["same"] = [{"slot": s, "state": list(t)} for s, t in (law.same if law else ())]
    row |= {"held_out": judged(block, key), "sentence": ""}
    if law is not None and term.free:
        row |= {"unit": unit_of(law), "values": curve(block, key)}
        row["sentence"] = sentence(told("law.j2", law=row, units=GIVEN["units"]))
    if row["held_out"]["beyond_band"] > DOES_NOT_FIT:
        row |= {"names": [], "single": None, "forms": [], "formulas": {}}
    return row


def _error(block, key):
    """Of an error of the set-up: how large it is, as a share of the reading or, of a single level
    or a zero, in the lever's unit too."""
    term = block.terms[key]
    readings, at = block.readings.of(term.experiment)
    part = block.part(key)[at]
    sd = float(np.std(part)) if term.what != "one level" else float(np.abs(part).max())
    row = {"of": term.of, "what": term.what, "sd": sd}
    if term.what == "levels":
        levels = readings.folds[term.of]
        value = readings.levers[term.of]
        row["offsets"] = {f"{value[i[0]]:g}": float(np.expm1(part[i[0]] - part.mean()))
                          for i in levels}  # fmt: skip
    elif term.what == "one level":
        index = int(np.argmax(np.abs(part)))
        level = float(readings.levers[term.of][index])
        row |= {"level": level, "share": float(np.expm1(part[index]))}
        if getattr(QUANTITIES[term.experiment].scale, "lever", None) == term.of:
            row["reads_like"] = level * (1.0 + row["share"])
    elif term.what == "exchanged":
        row["exchanged"] = [float(v) for v in block.held[key].shape.name.split(" and ")]
    elif term.what == "zero":
        row["value"] = block.strength(key)
    elif term.of == "resolution":
        row["step"] = term.more["step"]
    else:
        order = np.argsort(readings.rows)
        row["share"] = float(np.expm1(part[order[-1]] - part[order[0]]))
    return row


def _of_readings(kind, of, what, sd, p, evidence, **more):
    """The row of an error that readings of an experiment have, though no term was held for it."""
    row = {"experiment": kind, "key": f"{kind}:{of}", "of": of, "what": what, "sd": float(sd)}
    return _told(row | {"p": p, "evidence": evidence, "rivals": []} | more)


def _row(measurements, block, key):
    [place] = block.terms[key].rows
    m = measurements[block.readings.rows[place]]
    off, expected = without_row(block, key, place)
    row = {"experiment": m.experiment, "line": m.line, "levers": m.levers, "value": float(m.value)}
    row["setting"] = int(block.readings.rows[place])
    row |= {"standard_deviations": off, "lines": list(m.lines) or [m.line]}
    at = np.exp(block.readings.log[place] - expected)
    readings, own = block.readings.of(m.experiment)
    here = own == place
    levers = {k: v[here] for k, v in readings.levers.items()}
    row["expected"] = float(from_log(m.experiment, np.array([expected]), levers)[0])
    row["reads_like"] = _looks_like(readings, here, at)
    return _told(row, at - 1.0)


def _told(row, more=None):
    """The row of an error or a reading with its sentence; more: share by which a reading is more
    than all others say."""
    return row | {"sentence": sentence(told("error.j2", row=row, more=more))}


def _looks_like(readings, here, at):
    """{lever, value} of another level that a row reads like, or None; here: (n,) which it is."""
    lever = getattr(QUANTITIES[readings.experiment].scale, "lever", None)
    if lever not in readings.folds:
        return None
    values = np.unique(readings.levers[lever])
    own = float(readings.levers[lever][here][0])
    off = np.abs(np.log(own * at / values)) / readings.error[here]
    best = int(np.argmin(off))
    like = off[best] < 3.0 and values[best] != own
    return {"lever": lever, "value": float(values[best])} if like else None


def _not_held(measurements, block, misfit, left):
    """Rows of errors that readings have though no term was held for them; misfit, left: chances of
    constant coefficients, and of what was found.

    Of batches and instruments that are there almost surely, with how much each of them reads too
    high or too low, as a share of the mean of all; where a misfit is left, of settings where these
    are likelier than not; else of a step that is coarser than the errors of the readings."""
    held = {h.term.experiment for h in block.held.values() if h.term.of == "resolution"}
    for kind in block.readings.experiments:
        readings, at = block.readings.of(kind)
        for name, code in (readings.groups | {"settings": None}).items():
            key = block.readings.name_of(name, kind)
            there, sd = block.chance_of(key), block.sd_of(key)[at].max()
            odds = float(np.log(there / max(1.0 - there, 1e-9))) if there >= 0.5 else -np.inf
            if code is not None and there > SURE:
                labels = sorted({getattr(measurements[i], name) for i in readings.rows} - {""})
                more = {"offsets": dict(zip(labels, _offsets(block, code, at), strict=True))}
                yield _of_readings(kind, name, "declared", sd, 1.0 - there, odds, **more)
            elif code is None and there >= 0.5 and left < MISFIT:
                yield _of_readings(kind, name, name, sd, left, odds)
        if readings.coarse and kind not in held and left >= MISFIT:
            known = np.median(rounded_off(readings)), misfit, -float(np.log(misfit))
            yield _of_readings(kind, "resolution", "digits", *known, step=readings.step)


def _offsets(block, code, at):
    """Shares (g,) by which the readings of each of g batches or instruments are off their mean, by
    least squares beside what is held; code: (k,) of the readings at places (k,)."""
    weight = 1.0 / block.readings.error[at] ** 2
    left = (block.y - sum(block.part(key) for key in block.held))[at]
    left = left if block.ground is None else left - block.expected()[0][at]
    some = code >= 0
    code, weight, left = code[some], weight[some], left[some]
    means = np.bincount(code, weight * left) / np.bincount(code, weight)
    return np.expm1(means - means.mean()).tolist()


def _ranking(start, found):
    """[{mechanism, gain, p}] of the catalogue, each alone in the model, best first."""
    rows = []
    for term, shape, gain in (one for b in start.values() for one in catalogue_gains(b)):
        row = {"mechanism": shape.name, "experiment": term.experiment, "gain": gain}
        row |= {"p": share_above(found.null, gain), "null_threshold": found.threshold}
        rows.append(row)
    return sorted(rows, key=lambda r: -r["gain"])


def catalogue_gains(block: Block) -> Iterator[tuple[Term, Shape, float]]:
    """Each mechanism of the catalogue in a block: its term, its shape, and the log evidence for it
    alone."""
    terms = block.terms.values()
    for term, shape in ((t, s) for t in terms for s in t.shapes if s.catalogue):
        own = replace(term, shapes=(replace(shape, weight=0.0),))
        yield term, shape, float(block.evidence(own, block.y[None], block.here)[0])


def judge(found: Found, bends: Callable[[], bool] = lambda: False) -> Found:
    """The same with its verdict. bends: whether the readings follow a smooth curve along a
    lever."""
    few = [law for law in found.laws if _is_of_few(found.block_of(law["key"]), law["key"])]
    for law in few:
        if not any(r.get("of") == "settings" for r in law["rivals"]):
            own = {"experiment": law["experiment"], "behind": law["evidence"]}
            law["rivals"].append(SCATTER | own)
    constant = found.misfit["p"] >= MISFIT
    scattered = found.scattered is None or found.scattered["p"] >= MISFIT
    said = found.laws, found.errors, found.rows
    found.decided = by_readings(Evidence(*said, constant, scattered, bool(few), bends))
    return found


def _next(out):
    """The measurement that parts the strongest term from its rivals, or the forms of a law; else
    from what it is told from by the evidence alone, where that is not clear."""
    rows = (*out.laws, *out.errors)
    wrong = next((r["level"] for row in rows for r in row["rivals"] if r.get("level")), "")
    for row in rows:
        if row["rivals"]:
            block = out.block_of(row["key"])
            near = [r.key for r in chosen.rivals(block, row["key"])]
            scatter = [None] * any(r.get("of") == "settings" for r in row["rivals"])
            found = _telling(propose_setting(block, row["key"], scatter + near, wrong))
            if found:
                return found
    for row in rows:
        other = row.get("set_anew")
        if other and other["behind"] < chosen.CLEAR:
            return _telling(propose_setting(out.block_of(row["key"]), row["key"], [other["key"]]))
    return None


def _telling(proposed):
    """A setting that is proposed, None where a reading there would tell next to nothing."""
    return proposed if proposed and proposed["information_bits"] >= LEAST_BITS else None


def give_strengths(
    found: Found, catalogue: Mapping[str, Mechanism]
) -> dict[str, dict[str, dict[str, Any]]]:
    """{key of a law: {mechanism: {name, unit, value, low, high}}} of the mechanisms that it is
    left: the strength with its 95 % interval, cut at its range. Its row and the ranking get them
    too."""
    out: dict[str, dict[str, dict[str, Any]]] = {}
    for law in found.laws:
        block, coded = found.block_of(law["key"]), law.pop("coded")
        term = block.terms[law["key"]]
        strong = out[law["key"]] = {}
        for shape in (s for s in term.shapes if s.name in coded and s.name in catalogue):
            own = catalogue[shape.name].strength
            ends = strength_limits(block, term, shape, 0.5 + 0.5 * BAND)
            low, high = sorted(float(own.natural(open_end if end is None else end))
                               for end, open_end in zip(ends, (0.0, 1.0), strict=True))  # fmt: skip
            row = {"name": own.name, "unit": own.unit, "low": low, "high": high}
            strong[shape.name] = row | {"value": float(own.natural(coded[shape.name]))}
        law["strengths"] = {name: s["value"] for name, s in strong.items()}
        for row in found.ranking:
            if row["mechanism"] in strong and row["experiment"] == law["experiment"]:
                row["strength"] = {row["mechanism"]: strong[row["mechanism"]]}
    return out
