"""What the model of a whole table says of closed forms: laws, errors of the set-up, faulty rows.

The tables are made here, by formulas alone. Each effect is about ten standard errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from calibration.intake.measurements import Measurement
from diagnosis.laws.readings import readings_of
from diagnosis.rules import OF_CONTACTS, by_runs, without_names
from diagnosis.table_model import found as found_module
from diagnosis.table_model.block import LEVEL_SD, curve_shape
from diagnosis.table_model.found import discover
from diagnosis.table_model.selection import blocks_of
from facts import tells

ERROR, N = 0.02, 5  # of one reading, and readings of a setting
CHANCE = (199, 199)
HEIGHTS, SIZES = (50.0, 100.0, 200.0, 400.0), (1.0, 2.0, 4.0)


def speed(height):
    return np.sqrt(2e-3 * 9.81 * height)


def rows(kind, settings, value, seed=0, **more):
    """Means of N readings of value(setting) at settings [{lever: value}]."""
    rng, out = np.random.default_rng([seed, len(kind)]), []
    for k, at in enumerate(settings):
        read = value(at) * (1.0 + ERROR * rng.standard_normal(N))
        out.append(Measurement(kind, read.mean(), read.std(ddof=1), N, at, line=k + 2, **more))
    return out


def drops(restitution, heights=HEIGHTS, sizes=SIZES, seed=0):
    settings = [{"drop_height_mm": h, "particle_diameter_mm": d} for h in heights for d in sizes]

    def value(at):
        return at["drop_height_mm"] * restitution(*at.values()) ** 2

    return rows("drop", settings, value, seed)


def slides(angle, rates=(2.0, 5.0, 10.0, 20.0), sizes=SIZES, seed=0):
    settings = [{"tilt_rate_deg_s": r, "particle_diameter_mm": d} for r in rates for d in sizes]
    return rows("tilt", settings, lambda at: angle(*at.values()), seed)


def found(measured, known=None):
    return discover(measured, known, chance=CHANCE)


def places(said):
    return [(law["experiment"], law["slot"], tuple(law["state"])) for law in said.laws]


def test_the_evidence_is_that_of_the_normal_law():
    """Of a random error of each height, by scipy, all sizes of the errors averaged."""
    readings = readings_of(drops(lambda h, d: 0.7), "drop")
    [block] = blocks_of([readings], None).values()
    term, y = block.terms["drop:levels of drop_height_mm"], readings.log
    same = (readings.levers["drop_height_mm"][:, None] == readings.levers["drop_height_mm"]) * 1.0
    noise = [
        np.diag(readings.error**2) + (block.unit * c.get("settings", 0.0)) ** 2 * np.eye(len(y))
        for c in block.sds
    ]

    def density(more):
        own = [
            multivariate_normal.logpdf(y, readings.centre, n + LEVEL_SD**2 + more) for n in noise
        ]
        return logsumexp(np.array(own) + block.prior)

    sizes = term.shapes[0].label
    direct = logsumexp([density(s**2 * same) for s in sizes]) - np.log(len(sizes)) - density(0.0)
    assert float(block.evidence(term, y[None])[0]) == pytest.approx(direct, abs=1e-4)


def shears(stress, loads, sizes, seed=0):
    settings = [{"normal_stress_kPa": s, "particle_diameter_mm": d} for s in loads for d in sizes]
    return rows("shear", settings, lambda at: stress(*at.values()), seed)


def test_a_friction_over_the_inertial_number_is_one_law_of_two_levers():
    """mu = a + b I with I ~ d / sqrt(load) at one rate of shear (GDR MiDi 2004)."""
    said = found(shears(lambda s, d: s * (0.4 + 0.1 * d / s**0.5),
                        (0.5, 1.0, 2.0, 4.0), (1.0, 2.0, 4.0)))  # fmt: skip
    state = "size over root of load"
    assert places(said) == [("shear", "friction", (state,))]
    assert said.verdict == "discovered"


def test_an_intercept_of_a_locus_has_five_causes():
    said = found(shears(lambda s, d: 0.5 * s + 0.3, (0.5, 1.0, 2.0, 4.0, 8.0), (2.0,)))
    assert places(said) == [("shear", "attraction", ())]
    same = {(s["slot"], tuple(s["state"])) for s in said.laws[0]["same"]}
    assert same == {(slot, ()) for slot in ("load", "mass", "reading", "wall friction")}


def test_a_slide_seen_after_a_share_of_the_diameter_is_a_law_of_the_froude_number():
    """Slip of one diameter d at a rate w: late by (6 d cos(a) w^2 / g)^(1/3)."""

    def angle(r, d):
        w = np.radians(r)
        return 30.0 + np.degrees(np.cbrt(6e-3 * d * np.cos(np.radians(30.0)) * w**2 / 9.81))

    said = found(slides(angle, rates=(2.0, 5.0, 12.0, 30.0), sizes=(1.0, 2.0, 4.0, 8.0)))
    assert places(said) == [("tilt", "reading", ("Froude number",))]


def test_a_pull_on_grains_that_carry_a_mass_has_the_form_of_both():
    """Pull ~ d over the weight of the grain and of a mass that each carries."""
    sizes = (0.5, 0.8, 1.2, 2.0, 3.0, 5.0)
    middle = (0.5 * 5.0) ** 0.5

    def angle(r, d):
        pull = 2.0 * d / (d**3 + middle**3)
        return np.degrees(np.arctan(0.4 * (1.0 + pull)))

    said = found(slides(angle, rates=(2.0, 5.0, 10.0), sizes=sizes))
    assert said.laws[0]["experiment"] == "tilt"
    assert (said.laws[0]["slot"], said.laws[0]["state"]) == ("mass", ["size"])
    assert said.laws[0]["forms"][0].startswith("force ~ d,")
    assert tells(said.laws[0]["forms"][0], "mass", "1")
    assert {s["slot"] for s in said.laws[0]["same"]} == {"friction", "attraction"}


@pytest.mark.parametrize("line", [2, 9])
def test_a_row_that_is_off_is_pointed_at_beside_a_law(line):
    """The law is fitted with the row at first, which hides both."""
    heights = (50.0, 100.0, 200.0, 400.0)
    measured = drops(lambda h, d: 0.5 * speed(h) ** -0.16, heights, (2.0, 4.0))
    measured = [replace(m, value=0.7 * m.value) if m.line == line else m for m in measured]
    said = found(measured)
    assert places(said) == [("drop", "restitution", ("speed",))]
    assert [row["line"] for row in said.rows] == [line]


def bent(u):
    """A curve that no form of restitution over speed follows: it falls and rises again."""
    return -0.25 * np.sin(2.0 * np.pi * u)


def known_of(sign):
    def known(readings):
        if readings.experiment != "drop":
            return []
        height = np.log(readings.levers["drop_height_mm"] / HEIGHTS[0])
        curve = bent(height / np.log(HEIGHTS[-1] / HEIGHTS[0]))
        label = np.linspace(0.0, 1.0, 21)
        place = ("restitution", ("speed",))
        return [(place, curve_shape("film", label, sign * label[:, None] * curve, catalogue=True))]

    return known


FINER = (50.0, 75.0, 110.0, 160.0, 240.0, 400.0)


def sine(h, d):
    return 0.7 * np.exp(0.5 * 0.6 * bent(np.log(h / 50.0) / np.log(8.0)))


def test_the_mechanism_that_made_the_data_is_named():
    said = found(drops(sine, FINER), known_of(1.0))
    assert (said.verdict, said.causes) == ("identified", ["film"])
    assert said.laws[0]["coded"]["film"] == pytest.approx(0.6, abs=0.05)
    assert said.ranking[0]["mechanism"] == "film"


@pytest.mark.slow
def test_a_mechanism_of_the_wrong_sign_is_not_named():
    said = found(drops(sine, FINER), known_of(-1.0))
    assert said.causes == []
    assert said.laws[0]["names"] == []


@pytest.mark.slow
def test_a_mechanism_that_only_resembles_the_data_must_beat_the_free_law():
    """Data of half the curve and half a power: the mechanism explains much and does not fit."""
    said = found(drops(lambda h, d: sine(h, d) * speed(h) ** -0.2, FINER), known_of(1.0))
    assert said.causes == []
    assert said.laws[0]["names"] == []
    assert said.laws[0]["state"] == ["speed"]


def test_the_judge_tells_a_law_that_fits_from_one_that_does_not():
    """A power predicts the inner heights of a power, and not those of a curve with two bends."""
    key = "drop:restitution(speed)"
    for curve, fits in ((lambda h, d: 0.6 * speed(h) ** -0.4, True), (sine, False)):
        [block] = blocks_of([readings_of(drops(curve, FINER), "drop")], None).values()
        power = tuple(s for s in block.terms[key].shapes if s.name == "power")
        block.terms[key] = replace(block.terms[key], shapes=power)
        judged = found_module.judged(block.holding(key), key)
        assert (judged["after"] < 2.0) == fits
        assert (judged["after"] < 0.5 * judged["before"]) == fits


@pytest.mark.parametrize(
    ("interval", "after", "verdict"),
    [((0.4, 1.2), 1.0, "identified"), ((-1.04, -0.07), 2.0, "discovered"),
     ((-0.2, 0.9), 1.0, "ambiguous"), ((0.4, 1.2), 8.4, "discovered")],
)  # fmt: skip
def test_the_engine_takes_back_a_name_or_a_place(interval, after, verdict):
    gain = {"held_out_rmse_difference_interval": interval, "held_out_rmse_after_all_errors": after}
    law = {"names": ["apex_sampling"], "single": "apex_sampling", "gain": gain, "evidence": 9.0}
    told = {"verdict": "identified", "causes": ["apex_sampling"], "laws": [law], "reason": ""}
    said = by_runs(without_names(told), OF_CONTACTS)
    assert said["verdict"] == verdict
    assert bool(said["causes"]) == (verdict != "discovered")
    assert bool(said["laws"][0]["names"]) == (verdict != "discovered")


def test_of_two_instruments_the_one_that_reads_higher_is_named():
    """B reads 3 % higher than A; each height and size is read by both."""
    measured = []
    for k, name in enumerate("AB"):
        read = drops(lambda h, d, k=k: 0.7 * 1.03 ** (0.5 * k), seed=k)
        measured += [replace(m, instrument=name) for m in read]
    said = found(measured)
    [error] = [e for e in said.errors if e["what"] == "declared"]
    assert error["offsets"]["B"] - error["offsets"]["A"] == pytest.approx(0.03, abs=0.01)
    assert tells(error["sentence"], "higher with instrument B than with A")


def test_a_column_that_holds_zero_and_less_is_told_as_it_was_recorded():
    """The restitution falls by a tenth from -10 to 40 degrees."""
    degrees = np.linspace(-10.0, 40.0, 12)
    measured = [
        replace(m, value=m.value * (1.0 - 0.002 * (t + 10.0)) ** 2, covariates={"degrees": t})
        for m, t in zip(drops(lambda h, d: 0.8), degrees, strict=True)
    ]
    said = found(measured)
    [law] = [law for law in said.laws if law["state"] == ["degrees"]]
    states = [v["state"] for v in law["values"]]
    assert (min(states), max(states)) == pytest.approx((-10.0, 40.0))
    assert [law["values"][k]["state"] for k in (0, -1)] == pytest.approx([-10.0, 40.0])


def test_a_step_over_the_size_is_a_law_and_no_error_of_each_size():
    """A film on grains below 1.4 mm; the same plan with an error of its own for each size is told
    as one, without a step."""
    heights, sizes = (50.0, 100.0, 150.0, 200.0, 300.0, 400.0), (0.8, 1.0, 1.25, 1.6, 2.0, 2.5)
    said = found(drops(lambda h, d: 0.7 * (1.0 + 0.05 * (d < 1.4)), heights, sizes))
    assert places(said) == [("drop", "restitution", ("size",))]
    [law] = said.laws
    assert law["forms"] == ["step at 1.414"]
    assert not said.errors
    off = dict(zip(sizes, (-0.016, -0.026, 0.032, -0.035, 0.023, 0.002), strict=True))
    said = found(drops(lambda h, d: 0.7 * (1.0 + off[d]), heights, sizes))
    assert [e["what"] for e in said.errors] == ["levels"]
    assert not any("step" in form for law in said.laws for form in law["forms"])
    # only a size that is set anew shows that no smooth law did it
    [error] = said.errors
    assert (error["set_anew"]["slot"], error["set_anew"]["state"]) == ("restitution", ["size"])
    assert (
        said.next_setting is None or "Set the grain diameter up anew" in said.next_setting["text"]
    )


def test_one_class_under_a_wrong_label_does_not_hide_the_law_over_all_classes():
    """The class of 2 mm is one of 5.6 mm: the law is a rival of an error of each size, and says
    which class would then be labelled wrongly."""
    sizes = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6)
    said = found(drops(lambda h, d: 0.7 * (5.6 if d == 2.0 else d) ** -0.1, HEIGHTS, sizes))
    assert said.verdict == "ambiguous"
    assert places(said) == [("drop", "restitution", ("size",))]
    [law] = said.laws
    assert "2 mm" in law["sentence"]
    assert "power" in law["forms"]
    assert tells(said.next_setting["text"], "anew at 2 mm")


def test_a_column_that_acts_on_large_grains_alone_is_a_law_of_both():
    """Wear counts at 2 mm and above; a column that acts alike at all sizes is one of its own."""
    sizes, rng = (1.0, 1.4, 2.0, 2.8, 4.0), np.random.default_rng(8)

    def worn(acts):
        table = drops(lambda h, d: 0.7, HEIGHTS, sizes)
        share = rng.permutation(len(table)) / (len(table) - 1.0)
        return [
            replace(
                m, value=m.value * (1.0 - 0.1 * w * acts(m.levers["particle_diameter_mm"])) ** 2,
                covariates={"impacts": 3000.0 * w},
            )
            for m, w in zip(table, share, strict=True)
        ]  # fmt: skip

    said = found(worn(lambda d: d > 1.9))
    assert places(said) == [("drop", "restitution", ("impacts", "size"))]
    first, *_, last = said.laws[0]["values"]
    assert first["low"] < 0.0 < first["high"]
    assert last["low"] < -0.1 < last["high"]
    assert places(found(worn(lambda d: 1.0))) == [("drop", "restitution", ("impacts",))]


def test_readings_without_a_batch_are_of_none():
    """Two lots are off by a tenth either way; a third of the readings names no lot."""
    rng, off = np.random.default_rng(0), {"A": 0.1, "B": -0.1, "": 0.0}
    table = [
        Measurement("drop", v, 0.02 * v, 4, {"drop_height_mm": h}, batch=lot, line=line)
        for line, (h, lot) in enumerate([(h, lot) for h in HEIGHTS for lot in off] * 2)
        for v in [0.3 * h * np.exp(off[lot] + 0.01 * rng.standard_normal())]
    ]
    said = found(table)
    assert said.verdict == "adequate"
    [declared] = said.errors
    assert declared["of"] == "batch"
    assert declared["offsets"] == pytest.approx({"A": 0.105, "B": -0.095}, abs=0.015)
