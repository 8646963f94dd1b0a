"""Named forms of a free law, with one number each, and the test between them.

Forms that multiply are 1 at the middle of the plan's states (u = state over that), so that level
and shape do not trade against each other. Forms that add are the weight of their slot times a power
of u. Sources: a viscous contact 1 - e ~ v^(1/5) (Brilliantov and others 1996, Phys. Rev. E
53:5382), yielding v^(-1/4) (Johnson 1985, Contact Mechanics, 11.5), a fixed loss of energy
(Thornton and Ning 1998, Powder Technol. 99:154), a film 1 - St_c/St (Davis, Serayssol, Hinch 1986,
J. Fluid Mech. 163:479), an elastic plate (Zener 1941, Phys. Rev. 59:669), contact adhesion ~ d and
its work ~ d^(4/3) (Johnson, Kendall, Roberts 1971, Proc. R. Soc. A 324:301).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from diagnosis.chance import share_above
from diagnosis.laws.mixed import Candidate, draw, evaluate, posterior
from diagnosis.laws.readings import IN_AIR
from diagnosis.laws.slots import scaled

LADDER = np.geomspace(0.003, 0.8, 36)
"""Changes of the logarithm over half the range of the states that a form is tried at, in both
directions."""

LEAST = 0.02  # of a factor; below it a form has no meaning any more
RULED_OUT = 0.02
FINE = 81  # strengths between five of the ladder, for the coefficients that are told


@dataclass(frozen=True)
class Form:
    """factor(u, k) that multiplies the coefficient, and its text with {c} (the coefficient in the
    middle of the plan), {k}, {s} (the state) and {m} (its middle) to fill in."""

    name: str
    factor: object
    text: str


MULTIPLIES = (
    Form("constant slope", lambda u, k: 1.0 + k * (u - 1.0), "{c} (1 {k:+.3g} ({s}/{m} - 1))"),
    Form("power", lambda u, k: u**k, "{c} ({s}/{m})^{k:.3g}"),
    Form("exponential", lambda u, k: np.exp(k * (u - 1.0)), "{c} exp({k:.3g} ({s}/{m} - 1))"),
    Form("logarithm", lambda u, k: 1.0 + k * np.log(u), "{c} (1 {k:+.3g} ln({s}/{m}))"),
    Form("fifth root", lambda u, k: 1.0 + k * (u**0.2 - 1.0),
    "{c} (1 {k:+.3g} (({s}/{m})^0.2 - 1))"),
    Form("inverse", lambda u, k: 1.0 + k * (1.0 / u - 1.0), "{c} (1 {k:+.3g} ({m}/{s} - 1))"),
    Form(
        "fixed loss of energy",
        lambda u, k: np.sqrt(np.maximum(1.0 + k * (u**-2.0 - 1.0), 0.0)),
        "{c} sqrt(1 {k:+.3g} (({m}/{s})^2 - 1))",
    ),
    Form("power 3/2", lambda u, k: 1.0 + k * (u**1.5 - 1.0),
    "{c} (1 {k:+.3g} (({s}/{m})^1.5 - 1))"),
)  # fmt: skip
ONSETS = np.geomspace(0.4, 2.5, 36)
THRESHOLD = Form(
    "threshold, then -1/4",
    lambda u, k: np.minimum(1.0, (u / k) ** -0.25) / min(1.0, k**0.25),
    "{c} constant up to {k:.3g} x {m}, then falling as {s}^(-1/4)",
)

ADDS = {
    ("attraction", "drop"): {"work ~ d^2": 0.0, "work ~ d^(4/3)": -2 / 3, "work ~ d": -1.0},
    ("attraction", "tilt"): {"force ~ d^2": 0.0, "force ~ d": -1.0,
    "force alike for all sizes": -2.0},
    ("attraction", "shear"): {"stress ~ 1/d": 0.0, "stress ~ 1/d^2": -1.0},
    ("reading", "size"): {"a share of the diameter": 0.0, "diameter squared": 1.0,
    "root of the diameter": -0.5},
    ("reading", "interval"): {"square of the interval": 0.0, "the interval": -1.0},
    ("reading", "rate"): {"rate^(2/3)": 0.0, "a fixed delay": 1 / 3, "rate^2": 4 / 3},
    ("drag", "size"): {"C_D constant": 0.0, "C_D ~ Re^(-1/2)": -0.5, "C_D ~ 1/Re": -1.0},
}  # fmt: skip
"""(slot, experiment or last state) -> powers of the state beyond the weight of the slot."""


def forms_of(law, readings, centre, known=()):
    """{name: Candidate} of the named forms of one free law; `known` {name: Candidate} of its slot
    and state join."""
    own = _added(law, readings, centre) if law.weight else _multiplied(law, readings)
    return own | dict(known)


def _multiplied(law, readings):
    x, _, half = scaled(law, readings.levers)
    u = np.exp(x * half)
    power = IN_AIR if law.experiment == "drop" else 1.0
    out = {}
    for form in (*MULTIPLIES, THRESHOLD) if law.slot == "restitution" else MULTIPLIES:
        ks = ONSETS if form is THRESHOLD else _strengths(form, u)
        curves = np.array([_logarithm(form, u, k) for k in ks])
        good = np.isfinite(curves).all(1)
        out[form.name] = _candidate(law, form.name, power * curves[good], ks[good])
    return out


def _logarithm(form, u, k):
    with np.errstate(all="ignore"):
        factor = form.factor(u, k)
        return np.where(factor > LEAST, np.log(np.maximum(factor, LEAST)), np.nan)


def _strengths(form, u):
    """Strengths (k,) at which the form changes by the steps of the ladder over half the range."""
    ends = np.array([u.min(), u.max()])
    step = 1e-4
    slope = np.ptp(form.factor(ends, step) - form.factor(ends, 0.0)) / step / 2.0
    return np.concatenate([-LADDER[::-1], LADDER]) / slope


def _candidate(law, name, curves, ks):
    n = curves.shape[1]
    flat = np.full(len(ks), -np.log(len(ks)))
    zero = np.zeros((1, n, n))
    return Candidate(
        name, law.slot, law.state, law.space, zero, np.zeros(1), curves, flat, np.asarray(ks)
    )


def _added(law, readings, centre):
    weight = law.weight(readings.levers, centre)
    x, _, half = scaled(law, readings.levers) if law.coordinate else (np.zeros(len(centre)), 0, 0)
    last = law.state[-1] if law.state else ""
    powers = ADDS.get((law.slot, law.experiment)) or ADDS.get((law.slot, last))
    if law.coordinate is None:
        powers = {"the same at all settings": 0.0}
    out = {}
    for name, power in powers.items():
        term = weight * np.exp(power * x * half)
        ks = law.sign * LADDER if law.sign else np.concatenate([-LADDER[::-1], LADDER])
        # a reading is never negative
        ks = ks[(ks[:, None] * term > -0.95).all(1)] if law.space != "log" else ks
        out[name] = _candidate(law, name, ks[:, None] * term, ks)
    return out


def written(law, tried, candidate, fitted, middle, told):
    """A named form with its coefficients, refitted to the readings; a mechanism's name alone.

    middle: the state in the middle of the plan with its unit, as text; told: amount -> text, of a
    term that adds."""
    name, log = candidate.name, tried.readings.log[None]
    if candidate.catalogue:
        return name
    candidate = _between(candidate, int(fitted.curve[0]))
    fitted = evaluate(candidate, tried.readings, tried.nuisance, log, tried.centre)
    k = float(candidate.label[fitted.curve[0]])
    state = " x ".join(law.state)
    if law.weight:
        return f"{name}: {told(k)}" + (f" at a {state} of {middle}" if state else "")
    mean, _ = posterior(candidate, tried.readings, tried.nuisance, fitted, log, tried.centre)
    level = float((tried.centre + mean - candidate.mean[fitted.curve[0]]).mean())
    own = np.exp(level / (IN_AIR if law.experiment == "drop" else 1.0))
    [text] = [f.text for f in (*MULTIPLIES, THRESHOLD) if f.name == name]
    return f"{name}: {law.slot} = " + text.format(c=f"{own:.3g}", k=k, s=state, m=middle)


def _between(candidate, best):
    """The form at strengths between those of the ladder about the best one."""
    near = np.arange(max(best - 2, 0), min(best + 3, len(candidate.label)))
    near = near[np.argsort(candidate.label[near])]
    at = candidate.label[near]
    fine = np.linspace(at[0], at[-1], FINE)
    curves = CubicSpline(at, candidate.mean[near])(fine)
    return replace(candidate, mean=curves, mean_prior=np.zeros(FINE), label=fine)


def compare(tried, candidates, replicates=99, seed=0):
    """[{form, lead, p, ruled_out}] by likelihood, best first, and {name: Fitted}.

    lead: nats of likelihood behind the best. p: share of data made by the form's own fit on which
    the best form leads by as much.
    """
    readings, nuisance, centre = tried.readings, tried.nuisance, tried.centre
    log = readings.log[None]
    fits = {k: evaluate(c, readings, nuisance, log, centre) for k, c in candidates.items()}
    order = sorted(fits, key=lambda k: -fits[k].likelihood[0])
    best = order[0]
    rng = np.random.default_rng([seed, 3])
    out = [{"form": best, "lead": 0.0, "p": 1.0, "ruled_out": False}]
    for name in order[1:]:
        lead = float(fits[best].likelihood[0] - fits[name].likelihood[0])
        p = 1.0 / (1 + replicates)
        if lead < 10.0:
            made = draw(
                candidates[name], nuisance, fits[name], log, centre, readings, replicates, rng
            )
            ahead = [
                evaluate(candidates[k], readings, nuisance, made, centre).likelihood
                for k in (best, name)
            ]
            p = share_above(ahead[0] - ahead[1], lead)
        out.append({"form": name, "lead": lead, "p": p, "ruled_out": p < RULED_OUT})
    return out, fits
