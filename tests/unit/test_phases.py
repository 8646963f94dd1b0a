"""A number only where there is one: phases that do not end as they must refuse the run, a clogged
funnel or a bare plate for its true cause; the flow through the funnel."""

import math
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest

from calibration.runs.runner import causes
from dem.contact.registry import ContactParameters, Laws, Material
from dem.errors import LightBodyError, MeasureError, RefusedStateError
from dem.experiments import heap, phases, setup
from dem.experiments.heap import flow_of
from dem.measure.heap import coverage, measure_heap, readings_apart
from dem.run import run
from dem.spec import parse_spec
from dem.walls.builder import WallSet
from facts import refused
from scenes import floor, make, measure
from small_heap import SPEC

RADIUS, G = 1e-3, 9.81
BED = {"count": 400, "diameter_mm": 2.0}


def spec_of(experiment, seconds, particles=BED, **geometry):
    return parse_spec(
        {
            "experiment": experiment,
            "particles": particles,
            "geometry": geometry,
            "numerics": {"max_time_s": seconds},
        }
    )


def test_a_bed_at_rest_has_one_and_the_walls_carry_it(tmp_path):
    result = run(spec_of("bulk_density", 3.0, vessel_diameter_mm=14, taps=0), tmp_path)
    assert result["metrics"]["hausner_ratio"] == pytest.approx(1.0, abs=2e-3)
    assert result["numerics"]["wall_force_over_weight"] == pytest.approx(1.0, abs=0.02)
    assert abs(result["numerics"]["restitution_error"]) < 0.1
    assert result["numerics"]["restitution_error_speed_m_s"] == pytest.approx(math.sqrt(0.02 * G))


@pytest.mark.parametrize(
    ("experiment", "particles", "geometry"),
    [
        ("discharge", {"count": 2600, "diameter_mm": 2.0},
         {"silo_diameter_mm": 30, "orifice_diameter_mm": 12}),
        ("drum", {"count": 400, "diameter_mm": 2.0},
         {"drum_diameter_mm": 30, "drum_width_mm": 8}),
        ("lifted_cylinder", {"count": 300, "diameter_mm": 2.0}, {}),
        ("bulk_density", BED, {"vessel_diameter_mm": 14, "taps": 0}),
    ],
)  # fmt: skip
def test_each_experiment_refuses_grains_that_still_fall(tmp_path, experiment, particles, geometry):
    with refused(RefusedStateError, "filling", kind="restless"):
        run(spec_of(experiment, 0.02, particles, **geometry), tmp_path)
    assert not (tmp_path / "result.json").exists()


def simulation(walls):
    contact, soft = ContactParameters(0.5, 0.5, 0.1), Material(1210.0, 3e6, 0.25)
    return make(contact, laws=Laws(), grain=soft, walls=walls, dt=1e-5, gravity=G)


def test_pressed_grains_move_against_their_weight_and_the_load_on_them():
    """By hand: half a squared speed over g r and, under a free lid that weighs as much as the grain
    and carries four times its weight more, over six times that. A lid that hangs presses nothing;
    one that slides up a slope of 60 degrees presses with the part of its weight along it."""
    grain, speed = 4 / 3 * math.pi * RADIUS**3 * 1210.0, 0.01
    alone = 0.5 * speed**2 / (9.80665 * RADIUS)
    slope = (0.0, math.cos(math.radians(60.0)), math.sin(math.radians(60.0)))
    for axis, mass, load, pressed in (
        ((0, 0, 1), grain, -4.0 * grain * 9.80665, 5.0),
        ((0, 0, -1), grain, 4.0 * grain * 9.80665, 5.0),
        ((0, 0, 1), grain, 2.0 * grain * 9.80665, 0.0),
        (slope, grain, 0.0, 0.75),
    ):
        free = {"mass": mass, "axis": axis, "load": load}
        walls = WallSet().body("lid", material="wall", origin=(0, 0, 0.05), free=free).disc(0.02)
        sim = simulation(walls)
        sim.add_particles([[0.0, 0.0, RADIUS]], RADIUS, velocity=[[speed, 0.0, 0.0]])
        assert phases.motion(sim) == pytest.approx(alone / (1.0 + pressed), rel=1e-3)
        sim.wall_state.mass[0] = 0.0
        assert phases.motion(sim) == pytest.approx(alone, rel=1e-3)


def test_a_free_lid_too_light_for_its_contacts_is_refused_and_a_heavy_one_rests():
    """Leapfrog bears a frequency of 2 / dt: S dt^2 < 4 M for a lid on springs of stiffness S."""
    for share, light in ((1e-3, True), (2.0, False)):
        grain = 4 / 3 * math.pi * RADIUS**3 * 1210.0
        free = {"mass": share * grain, "axis": (0, 0, 1), "load": -40.0 * grain * G}
        walls = floor().body("lid", material="wall", origin=(0, 0, 1.999 * RADIUS), free=free)
        sim = simulation(walls.disc(0.02))
        places = np.array([[x, y, RADIUS] for x in (-3e-3, 0.0, 3e-3) for y in (-3e-3, 0.0, 3e-3)])
        sim.add_particles(places, RADIUS)
        if light:
            with refused(LightBodyError, "lid", f"{share * grain:.3g} kg"):
                sim.advance(20000)
        else:
            sim.advance(20000)
            assert abs(sim.wall_state.velocity[1, 2]) < 0.1


def cone(height, plate=0.04, seed=1):
    rng = np.random.default_rng(seed)
    line, up = np.arange(-plate, plate, 2 * RADIUS), np.arange(RADIUS, 0.04, 2 * RADIUS)
    x = np.stack(np.meshgrid(line, line, up, indexing="ij"), -1).reshape(-1, 3)
    x = x + rng.uniform(-0.9 * RADIUS, 0.9 * RADIUS, x.shape)
    x[:, 2] = np.maximum(x[:, 2], RADIUS)
    inside = np.hypot(x[:, 0], x[:, 1]) < plate
    return x[inside & (x[:, 2] + RADIUS <= height(x[:, 0], x[:, 1]))]


def test_two_readings_that_differ_are_told_and_those_of_a_cone_are_not():
    t = math.tan(math.radians(30.0))
    shapes = {
        "cone": lambda x, y: t * (0.04 - np.hypot(x, y)),
        "ridge": lambda x, y: t * (0.025 - np.hypot(np.maximum(np.abs(x) - 0.015, 0.0), y)),
        "aside": lambda x, y: t * (0.028 - np.hypot(x - 0.01, y)),
    }
    told = {}
    for name, height in shapes.items():
        x = cone(height)
        found = measure_heap(x, np.full(len(x), RADIUS), np.zeros_like(x), 0.04)
        told[name] = readings_apart(found)
    assert told["cone"] is None
    assert "no one angle" in told["ridge"]
    assert "no one angle" in told["aside"]


def ended_after(monkeypatch, motion, angle):
    """Why and after how many looks a run ends; motion and angle: functions of the look."""
    spec, now = spec_of("heap", 12.0), SimpleNamespace(time=0.0)
    slopes, step = phases.Slopes(spec), phases.look(spec)
    for k in range(400):
        now.time = k * step
        monkeypatch.setattr(phases, "motion", lambda _, k=k: motion(k))
        why = slopes.ended(now, lambda k=k: (angle(k), 30.0))
        if why:
            return why, k
    return "", k


def test_a_run_ends_when_its_slopes_stand(monkeypatch):
    """0.1 degrees over ten looks, of grains of which a few tremble; at rest at once."""
    stir = 1e-3
    assert ended_after(monkeypatch, lambda k: 1e-6, lambda k: 30.0) == (phases.REST, 0)
    why, after = ended_after(monkeypatch, lambda k: stir, lambda k: 30.0)
    assert (why, 10 <= after <= 14) == (phases.STOOD, True)
    # the heap grows for 50 looks
    why, after = ended_after(monkeypatch, lambda k: stir, lambda k: min(0.5 * k, 25.0))
    assert (why, 58 <= after <= 68) == (phases.STOOD, True)
    # it creeps by 0.02 degrees a look, or moves every eighth look
    assert ended_after(monkeypatch, lambda k: stir, lambda k: 0.02 * k)[0] == ""
    assert ended_after(monkeypatch, lambda k: 0.1 if k % 8 == 0 else stir, lambda k: 30.0)[0] == ""


def test_a_heap_without_a_slope_does_not_stand(monkeypatch):
    def none(k):
        raise MeasureError("no heap")

    assert ended_after(monkeypatch, lambda k: 1e-3, none)[0] == ""


@pytest.mark.slow
def test_a_drop_in_air_has_the_restitution_of_its_impact(tmp_path):
    """The restitution of 0.8 read against the vacuum's speed is mostly drag."""
    result = measure(
        tmp_path,
        "drop",
        particles={"diameter_mm": 1.0},
        materials={"particle": {"density_kg_m3": 50, "shear_modulus_Pa": 1e6}},
        contacts={"particle_wall": {"restitution": 0.8}},
        laws={"drag": "schiller_naumann"},
        geometry={"drop_height_mm": 150},
    )
    assert result["effective_restitution"] == pytest.approx(0.8, abs=0.02)
    assert result["impact_speed_m_s"] < 0.9 * math.sqrt(2 * G * 0.15)


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
    record = []
    for t in np.linspace(0.0, 3.0, 301):
        made, out = min(100.0 * t, 100.0), np.clip(50.0 * (t - 0.5), 0.0, 100.0)
        record.append([t, made, made - out])
    found = flow_of(record)
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
    assert not any("roll or bounce" in cause for cause in causes(error.value, shut))
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
