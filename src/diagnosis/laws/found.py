"""What the free laws say of measurements: outliers, the law, its band and name, and how large other
errors are."""

from dataclasses import dataclass, field

import numpy as np

from calibration.statistics.numbers import NORMAL_95
from diagnosis.chance import share_above
from diagnosis.laws.choose import OF_CHANCE, ruled_out, trial
from diagnosis.laws.forms import compare, forms_of, written
from diagnosis.laws.mixed import from_space, posterior, to_space
from diagnosis.laws.next_setting import propose
from diagnosis.laws.readings import FREE, IN_AIR, SHAPE, from_log, readings_of, unknown
from diagnosis.laws.slots import BENDS, SIZES, bend, scaled
from diagnosis.measurements import LEAST_SETTINGS

OUTLYING = 5.0  # predictive standard deviations at which a single setting is set aside
MOST_OUTLIERS = 0.1  # share of settings
POINTS, DRAWS = 25, 2000
TIED = 0.05
DOES_NOT_FIT = 3.0  # standard errors on levels left out
SAME = 0.3  # standard errors; curves that stay closer are one
UNIT = {"speed": "m/s", "size": "mm", "rate": "°/s", "load": "kPa", "interval": "s", "height": "mm"}


@dataclass
class Found:
    """verdict: adequate, identified, discovered or ambiguous; law: the mapping of `verdict.json`,
    or None."""

    verdict: str
    causes: list
    law: dict | None
    p: float
    gain: float
    outliers: list
    scatter: list
    ranking: list
    trials: dict = field(repr=False)
    threshold: float = 0.0
    reason: str = ""
    next_setting: dict | None = None


def discover(measurements, known=(), alpha=0.05, seed=0, defaults=None, replicates=OF_CHANCE):
    """`Found` of the measurements of drops, slides and shear tests; None where there are none."""
    kinds = [k for k in FREE if sum(m.experiment == k for m in measurements) >= 3]
    tried, outliers = {}, []
    for number, kind in enumerate(kinds):
        readings = readings_of(measurements, kind, (defaults or {}).get(kind))
        if not readings.folds:
            continue
        readings, gone = _set_aside(readings, measurements)
        # random numbers of its own: by the same ones chance would favour both experiments at once
        tried[kind] = trial(readings, known, replicates, [seed, 1] + [number] * (number > 0))
        outliers += gone
    tried = {k: t for k, t in tried.items() if t.candidates}
    if not tried:
        return None
    scatter = [s for t in tried.values() for s in scatter_of(t)]
    gains = {(kind, n): g for kind, t in tried.items() for n, g in t.gains.items()}
    kind, best = max(gains, key=gains.get)
    null = np.max([np.max(list(t.null_gain.values()), axis=0) for t in tried.values()], axis=0)
    p = share_above(null, gains[kind, best])
    ranking = _ranking(tried, alpha)
    threshold = float(np.quantile(null, 1.0 - alpha))
    out = Found(
        "adequate", [], None, p, gains[kind, best], outliers, scatter, ranking, tried, threshold
    )
    if p >= alpha:
        out.reason = (
            "a constant coefficient and the errors between settings predict left-out levels as well"
        )
        return out
    return _law_or_misfit(out, tried[kind], best, seed)


def _law_or_misfit(out, tried, best, seed):
    """The named law, checked on levels that were left out of its choice as well as of its fit."""
    out = _name(out, tried, best, seed)
    out.law["held_out"] = held = held_out(tried)
    out.law["sentence"] = sentence_of(out.law)
    settings = len(tried.readings.log)
    if settings < LEAST_SETTINGS:
        out.verdict, out.causes = "ambiguous", []
        out.reason = (
            f"the law below would rest on {settings} settings; of fewer than {LEAST_SETTINGS} an "
            "error from one setting to the next is not told from a law"
        )
    elif held["beyond_band"] > DOES_NOT_FIT:
        out.verdict, out.causes = "unexplained", []
        out.reason = (
            f"the law below is the best of those tried and does not fit: levels that were left out "
            f"are missed by "
            f"{held['beyond_band']:.1f} of its own standard errors"
        )
    return out


def held_out(tried):
    """How left-out levels are missed: {settings, before, after, beyond_band}.

    before, after: root mean square miss in standard errors of the readings, without a law, and with
    a law that is chosen and fitted anew without the level. beyond_band: the miss with the law, in
    units of the error that the law states for itself there."""
    readings, misses = tried.readings, []
    for levels in readings.folds.values():
        for index in levels if len(levels) > 2 else []:
            others = trial(unknown(readings, index), replicates=0)
            (before, _), (after, own) = (
                _miss(c, f, others, index, readings) for c, f in _contenders(others)
            )
            misses += list(zip(before, after, own, strict=True))
    if not misses:
        return {"settings": 0, "before": 0.0, "after": 0.0, "beyond_band": 0.0}
    rms = np.sqrt(np.mean(np.square(misses), axis=0))
    names = ("before", "after", "beyond_band")
    return {"settings": len(misses)} | {n: float(r) for n, r in zip(names, rms, strict=True)}


def _miss(candidate, fit, others, index, readings):
    """Misses (k,) of the settings `index` by what the others predict: in errors of the readings,
    and in all errors."""
    z, precision = _state(candidate, fit, others)
    _, slope = to_space(candidate.space, readings.log, others.centre)
    covariance = np.linalg.inv(precision[np.ix_(index, index)])
    shift = covariance @ (precision @ z)[index] / slope[index]
    # the error that left the settings out is no error of the prediction
    removed = others.readings.error[index] ** 2 - readings.error[index] ** 2
    spread = np.diag(covariance) / slope[index] ** 2 - removed
    floor = readings.error[index] ** 2
    return shift / readings.error[index], shift / np.sqrt(np.maximum(spread, floor))


def predictions(tried):
    """Places (n,) among the measurements and the readings (n,) that the best law fitted to all
    predicts there."""
    best = max(tried.gains, key=tried.gains.get)
    log = tried.readings.log[None]
    mean, _ = posterior(
        tried.candidates[best], tried.readings, tried.nuisance, tried.fits[best], log, tried.centre
    )
    smooth = from_space(tried.candidates[best].space, mean, tried.centre)
    return tried.readings.rows, from_log(tried.readings.experiment, smooth, tried.readings.levers)


def sentence_of(law):
    """What the law says in physical words."""
    if not law["values"]:
        return ""
    first, last = law["values"][0], law["values"][-1]
    what = {"restitution": "restitution", "friction": "friction"}.get(law["slot"])
    unit = "" if law["unit"] == "1" else f" {law['unit']}"
    if not law["state"]:
        band = f"95 %: {first['low']:.3g} to {first['high']:.3g}"
        return f"The {law['slot']} adds {first['value']:.3g}{unit} ({band})."
    state = " x ".join(law["state"])
    own = " ".join(UNIT.get(s, "") for s in law["state"]).strip()
    verb = "falls" if last["value"] < first["value"] else "rises"
    subject = f"The {what}" if what else f"What the {law['slot']} adds"
    return (
        f"{subject} {verb} from {first['value']:.3g}{unit} at a {state} of "
        f"{first['state']:.3g} {own} to "
        f"{last['value']:.3g}{unit} at {last['state']:.3g} {own}."
    )


def _ranking(tried, alpha):
    """[{mechanism, gain, p, threshold}] of the catalogue's entries, best first."""
    rows = [
        {
            "mechanism": n,
            "gain": g,
            "p": share_above(t.null_gain[n], g),
            "threshold": float(np.quantile(t.null_gain[n], 1.0 - alpha)),
        }
        for t in tried.values()
        for n, g in t.gains.items()
        if t.candidates[n].catalogue
    ]
    return sorted(rows, key=lambda r: -r["gain"])


def scatter_of(tried, fit=None):
    """[{experiment, of, sd}] of the errors shared by or between settings, as shares, of the fit
    without a law."""
    fit = fit or tried.base_fit
    words = {"settings": "settings"}
    return [
        {
            "experiment": tried.readings.experiment,
            "of": words.get(name, name),
            "sd": float(sds[fit.nuisance[0]]),
        }
        for name, sds in tried.nuisance.sds.items()
        if sds[fit.nuisance[0]] > 0.0
    ]


# --- single settings at odds with all others ------------------------------------------------------


def _set_aside(readings, measurements):
    """Readings without single settings that neither a constant nor the best law predicts, and what
    was set aside."""
    gone = []
    for _ in range(max(1, int(MOST_OUTLIERS * len(readings.log)))):
        worst = _worst(readings)
        if worst is None:
            break
        place, off = worst
        m = measurements[readings.rows[place]]
        gone.append(
            {
                "experiment": m.experiment,
                "line": m.line,
                "levers": m.levers,
                "value": m.value,
                "standard_deviations": float(off),
            }
        )
        readings = readings.without([place])
    return readings, gone


def _worst(readings):
    """(place, distance) of the setting that is most at odds with what the others say, or None."""
    if len(readings.log) < 6:
        return None
    first = trial(readings, replicates=0)
    suspects = set()
    for candidate, fit in _contenders(first):
        z, precision = _state(candidate, fit, first)
        left = np.abs(precision @ z) / np.sqrt(np.diag(precision))
        suspects |= set(np.argsort(left)[-2:])
    distance = {i: _distance(readings, i) for i in suspects}
    place = max(distance, key=distance.get)
    return (int(place), distance[place]) if distance[place] > OUTLYING else None


def _contenders(tried):
    best = max(tried.gains, key=tried.gains.get)
    return [(tried.base, tried.base_fit), (tried.candidates[best], tried.fits[best])]


def _state(candidate, fit, tried):
    """z (n,) less the best curve, and the inverse covariance (n, n), at the best variances."""
    z, slope = to_space(candidate.space, tried.readings.log, tried.centre)
    shared = tried.nuisance.covariance[fit.nuisance[0]] * np.outer(slope, slope)
    total = shared + candidate.covariance[fit.smooth[0]] + candidate.level**2
    return z - candidate.mean[fit.curve[0]], np.linalg.inv(total + 1e-12 * np.eye(len(z)))


def _distance(readings, place):
    """How far a setting lies from what the others predict [sd]: under none, and under the law that
    they show best."""
    others = trial(unknown(readings, [place]), replicates=0)
    lost = others.readings.error[place]
    found = []
    for candidate, fit in _contenders(others):
        z, precision = _state(candidate, fit, others)
        variance = 1.0 / precision[place, place] - lost**2 + readings.error[place] ** 2
        miss = (precision @ z)[place] / precision[place, place]
        found.append(abs(miss) / np.sqrt(max(variance, readings.error[place] ** 2)))
    return float(min(found))


# --- the law --------------------------------------------------------------------------------------


def _name(out, tried, best, seed):
    """Fill in verdict, causes and law of data that show one."""
    candidate = tried.candidates[best]
    free = free_of(tried, candidate)
    rivals = _rivals(tried, best, candidate, free, seed)
    known = {n: c for n, c in tried.candidates.items() if c.catalogue}
    own = {n: c for n, c in known.items() if (c.slot, c.state) == (candidate.slot, candidate.state)}
    left, formula = [], None
    if free is not None:
        candidates = forms_of(free, tried.readings, tried.centre, own)
        forms, fits = compare(tried, candidates, seed=seed)
        left = _once([f["form"] for f in forms if not f["ruled_out"]], candidates, fits, tried)
        if len(left) == 1:
            formula = formula_of(free, tried, candidates[left[0]], fits[left[0]])
    out.law = _law(out, tried, candidate, free, left, rivals) | {"formula": formula}
    if free is not None:
        tied = [n for n in left if n not in known]
        out.next_setting = propose(tried, free, tied, [r["law"] for r in rivals], seed)
    beats = free is None or tried.gains.get(best, 0.0) >= tried.gains[free.name]
    if rivals:
        out.verdict = "ambiguous"
        out.reason = "laws of different states predict left-out levels about equally well"
        out.causes = [n for n in (best, *[r["law"] for r in rivals]) if n in known]
    elif candidate.catalogue and beats and (left == [best] or free is None):
        out.verdict, out.causes = "identified", [best]
        out.reason = (
            "predicts left-out levels better than every other law, the free one of its slot "
            "included"
        )
    elif len(left) == 1 and left[0] in own and tried.gains[left[0]] >= tried.gains[free.name]:
        out.verdict, out.causes = "identified", left
        out.reason = "no other form of this law fits, and it predicts better than the free one"
    else:
        out.verdict = "discovered"
        out.reason = (
            "a free law predicts left-out levels better than chance and better than every other"
        )
    return out


def formula_of(free, tried, candidate, fitted):
    """The one form that fits, with its coefficients and the units of the state."""
    state = middle_of(free, tried.readings)
    own = " ".join(UNIT.get(s, "") for s in free.state).strip()
    middle = f"{state[0]:.3g} {own}".rstrip()
    told, unit = told_in(free, tried, state), unit_of(free, tried.readings.experiment)

    def amount(k):
        return f"{told(0, k):+.3g}" + ("" if unit == "1" else f" {unit}")

    return written(free, tried, candidate, fitted, middle, amount)


def _once(left, candidates, fits, tried):
    """The forms without those that are the same curve here as a mechanism of the catalogue, which
    lends its name."""
    curve = {}
    for name in left:
        c = candidates[name]
        z = c.mean[fits[name].curve[0]]
        curve[name] = from_space(c.space, z, tried.centre) - tried.centre
    known = [n for n in left if candidates[n].catalogue]

    def alike(a, b):
        apart = curve[a] - curve[b]
        return np.abs((apart - apart.mean()) / tried.readings.error).max() < SAME

    return [n for n in left if n in known or not any(alike(n, k) for k in known)]


def free_of(tried, candidate):
    """The free law of a candidate's slot and state, or None."""
    for law in tried.laws.values():
        if (law.slot, law.state) == (candidate.slot, candidate.state):
            return law
    return None


def _rivals(tried, best, candidate, free, seed):
    """[{law, slot, state, behind, p}] of other slots and states that simulation does not rule out,
    but for those that are the same function of the levers of this plan."""
    gains, out = tried.gains, []
    others = [
        n
        for n in sorted(gains, key=lambda n: -gains[n])
        if (tried.candidates[n].slot, tried.candidates[n].state)
        != (candidate.slot, candidate.state)
    ]
    same = free.same if free is not None else ()
    others = [
        n for n in others if (tried.candidates[n].slot, tried.candidates[n].state) not in same
    ]
    for name in others[:4]:
        p = ruled_out(tried, best, name, seed=seed)
        if p >= TIED:
            c = tried.candidates[name]
            row = {"law": name, "slot": c.slot, "state": list(c.state)}
            out.append(row | {"behind": gains[best] - gains[name], "p": p})
    return out


def _law(out, tried, candidate, free, left, rivals):
    """The mapping `law` of verdict.json."""
    law = {
        "experiment": tried.readings.experiment,
        "slot": candidate.slot,
        "state": list(candidate.state),
        "gain": out.gain,
        "p": out.p,
        "values": [],
        "band": 0.95,
        "supported_range": {},
        "tied": [{"slot": r["slot"], "state": r["state"], "form": None} for r in rivals],
        "nearest_known": _nearest(tried, candidate),
    }
    law["unit"] = unit_of(candidate, tried.readings.experiment)
    if free is None:
        return law
    law["tied"] += [{"slot": s, "state": list(state), "form": None} for s, state in free.same]
    if len(left) > 1:
        law["tied"] += [
            {"slot": candidate.slot, "state": list(candidate.state), "form": f} for f in left
        ]
    law["values"], law["supported_range"] = curve(free, tried)
    return law


def _nearest(tried, candidate):
    """The catalogue's entry that is likeliest in the same slot, or None."""
    same = [n for n, c in tried.candidates.items() if c.catalogue and c.slot == candidate.slot]
    return max(same, key=lambda n: tried.fits[n].likelihood[0], default=None)


def unit_of(law, experiment):
    """Unit of a law's values; the state's own is that of its power product."""
    if law.slot in ("restitution", "friction"):
        return "1"
    if law.slot == "reading" and experiment == "tilt":
        return "deg"
    return {"drop": "mm", "tilt": "1", "shear": "kPa"}[experiment]


def curve(law, tried):
    """[{state, value, low, high}] along the state, and the range {state: [low, high]} that the
    settings cover.

    The band holds the whole curve in 95 % of cases.

    Restitution and friction are told as such. Terms that add are told in the reading's unit: what
    they add to it. All variances of the grid take part, by their likelihood.
    """
    readings, levers = tried.readings, tried.readings.levers
    x, middle, half = scaled(law, levers) if law.coordinate else (np.zeros(len(readings.log)), 0, 0)
    at = np.linspace(-1.0, 1.0, POINTS) if law.coordinate else np.zeros(1)
    mean, covariance = _average(law, tried, x, at)
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-16))
    rng = np.random.default_rng(5)
    size, direction = np.linalg.eigh(covariance)
    root = direction * np.sqrt(np.maximum(size, 0.0))
    wide = np.abs(rng.standard_normal((DRAWS, len(at))) @ root.T / spread).max(1)
    reach = max(float(np.quantile(wide, 0.95)), NORMAL_95) * spread
    state = np.exp(middle + half * at)
    told = told_in(law, tried, state)
    values = [
        {"state": float(s), "value": float(told(k, mean[k])),
         "low": float(told(k, mean[k] - reach[k])), "high": float(told(k, mean[k] + reach[k]))}
        for k, s in enumerate(state)
    ]  # fmt: skip
    for v in values:
        v["low"], v["high"] = sorted((v["low"], v["high"]))
    name = " x ".join(law.state) if law.state else "none"
    return values, {name: [float(state[0]), float(state[-1])]} if law.coordinate else {}


def middle_of(law, readings):
    """(1,) the state in the middle of the plan; 1 where the law has none."""
    return np.exp([scaled(law, readings.levers)[1]]) if law.coordinate else np.ones(1)


def told_in(law, tried, state):
    """A function of place and value that turns a curve over states (m,) in the law's space into
    what is told. What air takes depends on more than its state: it is told of the middle
    setting."""
    centre, readings = float(tried.centre[0]), tried.readings
    if law.weight is None:
        power = 1.0 / IN_AIR if readings.experiment == "drop" else 1.0
        most = 1.0 if law.slot == "restitution" else np.inf
        return lambda k, z: min(np.exp(power * (centre + z)), most)
    one = law.weight(readings.levers, tried.centre) * readings.levers.get(
        SHAPE.get(readings.experiment), 1.0
    )
    one = one * (np.degrees(np.arctan(np.exp(centre))) if law.space == "angle" else np.exp(centre))
    if law.coordinate is None or law.slot == "drag":
        return lambda k, z: float(np.median(one)) * z
    here = law.coordinate(readings.levers)
    least, most = np.argmin(np.where(one > 0.0, here, np.inf)), np.argmax(here)
    # a law of the simplest kind adds a power of its state
    power = np.log(one[most] / one[least]) / np.log(here[most] / here[least])
    return lambda k, z: float(one[most] * (state[k] / here[most]) ** power) * z


def _average(law, tried, x, at):
    """Mean (m,) and covariance (m, m) of the curve at scaled states, averaged over the grid of
    variances."""
    readings, nuisance, centre = tried.readings, tried.nuisance, tried.centre
    candidate = tried.candidates[law.name]
    z, slope = to_space(law.space, readings.log, centre)
    weight = law.weight(readings.levers, centre) if law.weight else np.ones(len(z))
    level = 0.0 if law.weight else candidate.level**2
    bends = BENDS if law.coordinate else (0.0,)
    shapes = [(s, b) for s in SIZES for b in bends]
    shared = nuisance.covariance * np.outer(slope, slope)
    total = shared[:, None] + (candidate.covariance + candidate.level**2)[None]
    inverse = np.linalg.inv(total)
    quadratic = np.einsum("i,ghij,j->gh", z, inverse, z)
    value = -0.5 * (quadratic + np.linalg.slogdet(total)[1]) + nuisance.prior[:, None]
    share = np.exp(value - value.max())
    share /= share.sum()
    mean, second = np.zeros(len(at)), np.zeros((len(at), len(at)))
    for g, h in np.argwhere(share > 2e-3):
        size, b = shapes[h]
        line = (lambda p, q: np.ones((len(p), len(q)))) if law.weight else np.outer
        own = size**2 * (line(at, at) + b**2 * bend(at, at)) + level
        cross = (size**2 * (line(at, x) + b**2 * bend(at, x)) + level) * weight
        gain = cross @ inverse[g, h]
        here = gain @ z
        mean += share[g, h] * here
        second += share[g, h] * (own - gain @ cross.T + np.outer(here, here))
    return mean, second - np.outer(mean, mean)
