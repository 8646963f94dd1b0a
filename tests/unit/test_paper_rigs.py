"""Which rig is well-posed: the rule of the plan, on tables whose answer is known."""

from itertools import product

import pandas as pd
import pytest

from paper.rigs import POINTS, RATES, READINGS, SPEEDS, chosen, judged


def heaps(change, held=lambda point, rate, speed: 700):
    """Two runs a rig and point; `change` and `held`, functions of (point, rate, speed), give the
    angle and the grains in the funnel."""
    rows = []
    for point, rate, speed, seed in product(POINTS, RATES, SPEEDS, (1, 2)):
        row = {"point": point, "generation_rate_per_s": rate, "injection_speed_m_s": speed}
        angle = change(point, rate, speed) + 0.1 * seed
        row |= {"seed": seed, "hold_up": held(point, rate, speed), **dict.fromkeys(READINGS, angle)}
        rows.append(row)
    return pd.DataFrame(rows)


def test_the_printed_rate_stays_at_the_least_speed_at_which_nothing_moves():
    def angle(point, rate, speed):
        return 45.0 - (2.0 if speed == 0.3 else 0.0)  # only the first speed is another

    rigs = judged(heaps(angle)).set_index(["rate", "speed"])
    assert rigs["well_posed"].to_dict() == {
        (rate, speed): speed == 1.0 for rate in RATES for speed in SPEEDS
    }
    assert rigs.loc[(10000, 0.3), "moves"] == pytest.approx(2.0)
    assert chosen(rigs.reset_index()) == (10000, 1.0)


def test_one_funnel_that_packs_at_one_point_makes_two_kinds():
    def packs(point, rate, speed):
        return 1400 if (point, rate, speed) == ("high", 10000, 1.0) else 700

    rigs = judged(heaps(lambda *_: 45.0, packs))
    assert rigs.loc[~rigs["one_kind"], ["rate", "speed"]].to_numpy().tolist() == [[10000, 1.0]]
    assert chosen(rigs) == (10000, 0.3)


def test_a_run_without_a_value_is_no_rig_of_one_kind():
    table = heaps(lambda *_: 45.0)
    table.loc[table["generation_rate_per_s"] == 10000, "hold_up"] = float("nan")
    assert chosen(judged(table)) == (6500, 0.3)


def test_where_all_move_the_slower_pour_is_taken_at_the_speed_that_moves_it_least():
    def angle(point, rate, speed):
        return 45.0 - speed * (1.0 if rate == 10000 else 2.0) * (3.0 if point == "low" else 1.0)

    def packs(point, rate, speed):
        return 1500 if (point, rate, speed) == ("high", 10000, 0.3) else 700

    rigs = judged(heaps(angle, packs))
    assert not rigs["well_posed"].any()
    # 10,000 moves less and is not well-posed all the same; the last speed has no next one
    assert chosen(rigs) == (6500, 0.3)
    assert rigs.set_index(["rate", "speed"]).loc[(6500, 0.3), "moves"] == pytest.approx(4.2)
