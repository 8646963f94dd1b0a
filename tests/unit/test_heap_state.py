"""A heap whose funnel is clogged or whose plate is bare is refused for its true cause; the flow
through the funnel."""

from copy import deepcopy

import numpy as np
import pytest

from calibration.runs.runner import NO_HEAP, causes
from dem.errors import MeasureError, RefusedStateError
from dem.experiments import heap, setup
from dem.experiments.heap import Flow
from dem.measure.heap import coverage
from dem.run import run
from dem.spec import parse_spec
from facts import refused
from small_heap import SPEC

GEOMETRY = {"generation_rate_per_s": 600}


def spec(geometry=(), **changes):
    """300 grains of 4 mm: poured in half a second."""
    return {
        "experiment": "heap",
        "particles": {"count": 300, "diameter_mm": 4.0},
        "geometry": GEOMETRY | dict(geometry),
    } | changes


def test_the_flow_of_a_steady_discharge_is_its_rate():
    """100 grains made in a second; they leave at 50 a second from 0.5 s on."""
    flow = Flow()
    for t in np.linspace(0.0, 3.0, 301):
        made, out = min(100.0 * t, 100.0), np.clip(50.0 * (t - 0.5), 0.0, 100.0)
        flow.record.append([t, made, made - out])
    found = flow.metrics()
    assert found["discharge_rate_per_s"] == pytest.approx(50.0, rel=0.02)
    assert found["emptying_time_s"] == pytest.approx(2.5, abs=0.02)
    assert found["hold_up"] == pytest.approx(75, abs=1)


def test_a_plate_is_covered_by_the_share_of_its_area_under_grains():
    rng = np.random.default_rng(0)
    out, turn = np.sqrt(rng.random(20_000)), 2.0 * np.pi * rng.random(20_000)
    for share in (1.0, 0.5):
        r = 0.04 * share * out
        position = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(len(r), 1e-3)])
        found = coverage(position, np.full(len(r), 1e-3), 0.04)
        # grains reach over the edge of what their centres cover, by a part of their radius
        assert share**2 - 0.01 < found < min((share + 0.03) ** 2, 1.0) + 1e-9


def test_grains_left_in_the_funnel_are_no_heap(tmp_path):
    shut = spec(numerics={"max_time_s": 0.52})
    with refused(RefusedStateError, "0.5 s", "300", kind="clogged") as error:
        run(parse_spec(shut), tmp_path)
    assert error.value.kind == "clogged"
    assert NO_HEAP not in causes(error.value, shut)
    assert not (tmp_path / "result.json").exists()


@pytest.mark.slow
def test_a_plate_that_is_not_covered_is_no_heap(tmp_path):
    wide = parse_spec(spec({"plate_diameter_mm": 200, "discharge_height_mm": 40}))
    with pytest.raises(MeasureError) as error:
        run(wide, tmp_path)
    # at this few grains either the cover or the slope is missing
    assert getattr(error.value, "kind", "uncovered") == "uncovered"
    assert "funnel" not in str(error.value)


@pytest.mark.slow
def test_a_filled_funnel_is_opened_onto_a_rimmed_plate(tmp_path):
    rig = {"feed": "opened", "orifice_diameter_mm": 32.0}
    rig |= {"plate_rim_height_mm": 3.0, "plate_diameter_mm": 50.0}
    metrics = run(parse_spec(spec(rig)), tmp_path)["metrics"]
    assert metrics["hold_up"] == 300
    assert metrics["in_funnel"] == 0
    # the last grain was made after half a second, and the gate opened after all were at rest
    assert metrics["emptying_time_s"] > 0.6
    assert metrics["plate_coverage"] > 0.5
    assert metrics["on_plate"] + metrics["spilled"] < 300  # the rest lies below the rim


def test_a_funnel_that_is_never_opened_is_not_clogged(tmp_path):
    """Closed and too little time for its grains to come to rest: nothing is known of its orifice,
    and the message says what to do."""
    rig = {"feed": "opened", "orifice_diameter_mm": 32.0}
    shut = spec(rig, numerics={"max_time_s": 0.52})
    with refused(RefusedStateError, "closed", "0.525", kind="restless") as error:
        run(parse_spec(shut), tmp_path)
    assert error.value.kind == "restless"
    assert "numerics.rayleigh_fraction" in str(error.value)
    assert "clogged" not in str(error.value)


def test_a_stack_at_the_rim_does_not_block_a_funnel():
    """Grains at rest in the mouth cost a funnel their own sites alone."""
    for feed, some in (("opened", True), ("rain", True)):
        made = parse_spec(spec({"feed": feed}))
        rig = heap.Rig(made.geometry)
        source = heap.Source(made, rig, np.random.default_rng(1))
        sim = setup.build_simulation(made, rig.walls())
        assert len(source.free_sites(sim)) == len(source.sites)
        sim.add_particles([[*source.sites[0], source.height]], 1e-3)
        free = source.free_sites(sim)
        assert source.make_layer(sim) is some
        if some:
            apart = np.hypot(*(free - source.sites[0]).T)
            assert apart.min() > source.pitch
            # a site has at most eight others beside it
            assert len(source.sites) - 9 <= len(free) < len(source.sites)


def test_a_heap_that_still_moves_at_its_time_limit_is_none(tmp_path):
    short = deepcopy(SPEC)
    pouring = SPEC["particles"]["count"] / parse_spec(SPEC).geometry.generation_rate_per_s
    short["numerics"]["max_time_s"] = pouring + 0.15  # the last grains have passed the funnel
    with refused(RefusedStateError, "max_time_s", kind="restless"):
        run(parse_spec(short), tmp_path)
