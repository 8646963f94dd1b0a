"""Two mechanisms at once are found, and one alone is one; closed forms train the emulators."""

import numpy as np
import pytest

from benchmarks.rates import single_grains
from benchmarks.rates.simulated import rate_settings
from calibration.intake.measurements import Measurement
from diagnosis.bulk import Bulk
from diagnosis.catalogue import load_catalogue
from diagnosis.design import inputs_of
from diagnosis.model import Emulated
from diagnosis.response import Response
from diagnosis.settings import BASE, parameters_of

SETTINGS = rate_settings()
FACTORS = parameters_of(SETTINGS, "config/factors.tsv", ["drop", "tilt"])
CONDITIONS = single_grains.PLAN
EFFECTS = {
    # change of the logarithm of a rebound, or of an emulated angle, at full strength
    ("drop", "air_drag"): lambda h, d: -0.8 * h / (0.3 + d),
    ("drop", "plastic_restitution"): lambda h, d: -0.3 * np.sqrt(h),
    ("tilt", "stress_dependent_friction"): lambda h, d: -0.25 * d,
}


@pytest.fixture(scope="module")
def emulated():
    rng, emulators = np.random.default_rng(5), {}
    for key in [("drop", BASE), ("tilt", BASE), *EFFECTS]:
        names = inputs_of(SETTINGS, FACTORS, *key)
        x = rng.random((40, len(names)))
        at = dict(zip(names, x.T, strict=True))
        [parameter] = set(names) & {f.name for f in FACTORS}
        z = 0.6 * at[parameter] - (1.0 if key[0] == "drop" else 0.0)
        if key in EFFECTS:
            effect = EFFECTS[key](at.get("drop_height_mm"), at["particle_diameter_mm"])
            z = z + at["strength"] * effect
        emulators[key] = Response(x, z, [])
    known = {n: m for n, m in load_catalogue().items() if n in {k[1] for k in EFFECTS}}
    return Emulated(emulators, SETTINGS, FACTORS, known)


def measured(emulated, names, seed):
    """Measurements of the plan with mechanisms at moderate strengths, five replicates a setting."""
    rng = np.random.default_rng([9, seed])
    model = emulated.model(CONDITIONS, names)
    free = rng.uniform(-0.5, 0.5, len(model.factors))
    true = model.predict(np.array([[*free, *rng.uniform(0.5, 0.8, len(names))]]))[0][0]
    rows = []
    for (experiment, levers), value in zip(CONDITIONS, true, strict=True):
        noise = 0.02 * value if experiment == "drop" else 0.4
        read = value + noise * rng.standard_normal(5)
        rows.append(Measurement(experiment, read.mean(), read.std(ddof=1), 5, dict(levers)))
    return rows


@pytest.mark.slow
def test_two_causes_that_act_at_once_are_found_and_one_alone_is_one(emulated):
    names = ["air_drag", "stress_dependent_friction"]
    found = Bulk(emulated, measured(emulated, names, 7)).judged()
    near = {r["slot"] for law in found.laws for r in (law, *law["rivals"]) if "slot" in r}
    assert len(found.laws) == 2
    assert {"drag", "friction"} <= near
    for seed, name in enumerate(("air_drag", "plastic_restitution", "stress_dependent_friction")):
        found = Bulk(emulated, measured(emulated, [name], seed)).judged()
        assert len(found.laws) == 1
        assert found.ranking[0]["mechanism"] == name
