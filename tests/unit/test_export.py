"""Exports: each conversion against the other code's own formula, the search's inversion, and
calibrated.yaml."""

import ast
import json
import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from calibration.chain.study import Study, read_region
from calibration.engines import lammps, liggghts, yade
from calibration.engines.conversion import Conversion, Granulate
from calibration.errors import CalibrationError
from calibration.stages import export as stage
from calibration.statistics.surface import fit_surface
from calibration.study.config import overlay, parse_config
from calibration.telling.export import by_hand, mercurydpm, rolling
from calibration.telling.export import files as written
from calibration.telling.export import parameters as sources
from calibration.telling.export.decks import DECKS, scatter_of_one, write_decks
from calibration.telling.export.parameters import parameter_interval, to_yaml
from dem.constants import GRAVITY
from dem.contact.catalogue import LAWS
from dem.contact.damping.tsuji import factor
from dem.contact.rolling.elastic_plastic import dashpot_of, spring_of
from dem.io.mapping import read_mapping
from dem.spec import ContactSpec, load_spec, parse_spec
from dem.units import in_ascii, unit_of
from facts import refused, rows_in, tells
from frozen import FROZEN
from other_codes import FOUND
from stage_files import Files, PlanFiles

REFERENCE = FROZEN / "salt"
OPTIMUM = json.loads((REFERENCE / "optimise" / "optimum.json").read_text())["optimum"]
MU_R = 0.9
FIXED = read_mapping("config/config.yaml")[0]["fixed"]
MU_S = (FIXED | OPTIMUM)["salt_salt_static_friction"]
SIEVED = {"by": "mass", "diameters_mm": [3.0, 4.0], "fractions": [0.5, 0.5]}
STICKY = {
    "laws": {"cohesion": "sjkr"}, "law_parameters": {"cohesion_energy_density_J_m3": 1e4}
}  # fmt: skip
EXPECTED = {
    "metric": "angle_of_repose_deg", "mean": 40.0, "sd": 0.5, "runs": 10, "margin": 1.0,
    "unit": "deg", "heaps": [],
}  # fmt: skip
PATH = rolling.PATHS["elastic_plastic"]


def agreement(mean):
    return {
        "mean": mean,
        "sd": 0.5,
        "runs": 5,
        "calibrated_law_mean": 45.0,
        "calibrated_law_sd": 0.4,
        "calibrated_law_runs": 6,
        "difference": mean - 45.0,
        "difference_interval_95": [mean - 45.5, mean - 44.5],
    }


def found(**changes):
    numbers = {"rolling_friction": MU_R, "static_friction": MU_S, "coarse": agreement(45.2)}
    return FOUND | numbers | changes


MU_HELD = 0.35
HELD = {"path": "no_rotation", "rolling_friction": 5.0, "static_friction": MU_HELD}


SOURCE = Files(optimum=REFERENCE / "optimise" / "optimum.json")


@pytest.fixture(scope="module")
def config():
    return parse_config(read_mapping("config/config.yaml")[0])


@pytest.fixture(scope="module")
def mapping(config):
    return stage._spec(Study(config, REFERENCE), SOURCE)


@pytest.fixture(scope="module")
def material(mapping):
    return Granulate(parse_spec(mapping))


def conversion(mapping, **changes):
    return Conversion(parse_spec(mapping), found(**changes))


def typed(code, spec):
    """The page of numbers to type into a code for a spec with nothing searched."""
    return by_hand.block(code, Granulate(spec), Conversion(spec), [])


def uncommented(text):
    """A block's text as one line, without the signs of its comments."""
    return " ".join(re.sub(r"^(#|//)", "", text, flags=re.M).split())


def mass(material):
    """Mass of the mean grain [kg]."""
    return 4 / 3 * math.pi * material.radius**3 * material.grain.density


def numbers(code, slot, name, pair):
    """What a code's file says of a law for a `Pair`."""
    return LAWS[slot][name].exports[code].numbers(pair)


def rolls(code, pair):
    return numbers(code, "rolling", "elastic_plastic", pair)


@pytest.fixture(scope="module")
def pairs(material, mapping):
    """The two `Pair`s, whose grains have the rolling friction MU_R on each other."""
    return conversion(mapping).pairs(material)


def test_effective_constants_are_those_of_hertz_and_mindlin(material):
    """E* = E/(2(1 - nu^2)) and G* = G/(2(2 - nu)) of equal grains; against a rigid wall the grain's
    own part."""
    g, p = material.grain, material.grain_grain
    assert p.young == pytest.approx(g.young_modulus / (2 * (1 - g.poisson_ratio**2)))
    assert p.shear == pytest.approx(g.shear_modulus / (2 * (2 - g.poisson_ratio)))
    assert material.grain_wall.young == pytest.approx(
        g.young_modulus / (1 - g.poisson_ratio**2), rel=1e-3
    )
    assert p.radius == material.radius / 2
    assert material.grain_wall.radius == material.radius


def test_contact_radius_gives_back_the_hertz_force(material):
    p = material.grain_grain
    assert p.load == pytest.approx(10 * mass(material) * GRAVITY)
    assert 4 / 3 * p.young * p.contact_radius**3 / p.radius == pytest.approx(p.load)


# --- LIGGGHTS -------------------------------------------------------------------------------------


def test_liggghts_rolling_spring_and_dashpot_are_ours(material, pairs):
    """epsd3: k_r = f k_n (mu R*)^2 with k_n = 4/3 E* a; dashpot 2 eta sqrt(I k_r), I = 1.4 m R^2
    reduced."""
    whole = mass(material)
    for p, m in zip(pairs, (whole / 2, whole), strict=True):
        theirs, mu_r = rolls("liggghts", p), p.contact.rolling_friction
        assert theirs["coefficientRollingFriction"] == mu_r
        k_n = 4 / 3 * p.young * p.contact_radius
        spring = theirs["rollingStiffness"] * k_n * (mu_r * p.radius) ** 2
        assert spring == pytest.approx(spring_of(p))
        inertia = 1.4 * m * material.radius**2
        dashpot = 2 * theirs["coefficientRollingViscousDamping"] * math.sqrt(inertia * spring)
        assert dashpot == pytest.approx(dashpot_of(p, spring))


def test_liggghts_block_has_full_symmetric_matrices(material, mapping):
    text = liggghts.block(material, conversion(mapping), ["where from"])
    for name in ("Restitution", "Friction", "RollingFriction", "RollingViscousDamping"):
        line = re.search(rf"^fix coefficient{name} .*peratomtypepair 2 (.*)$", text, re.M)
        values = [float(x) for x in line[1].split()]
        assert len(values) == 4
        assert values[1] == values[2]
    [young] = re.findall(r"youngsModulus peratomtype (\S+) (\S+)", text)
    assert [float(x) for x in young] == [7.5e6, 2.08e11]
    assert "hard_particles yes" in text
    assert "soft_particles" not in text
    [rolling] = re.findall(r"RollingFriction peratomtypepair 2 (.+)", text)
    on_steel = (FIXED | OPTIMUM)["salt_steel_rolling_friction"]
    assert [float(x) for x in rolling.split()] == pytest.approx([MU_R, *[on_steel] * 3], rel=1e-5)


def test_liggghts_is_told_of_soft_grains(mapping):
    soft = parse_spec(overlay(mapping, {"materials": {"particle": {"shear_modulus_Pa": 1e6}}}))
    text = liggghts.block(Granulate(soft), Conversion(soft, found()), [])
    assert "soft_particles yes" in text


# --- LAMMPS ---------------------------------------------------------------------------------------


def test_lammps_stiffnesses_and_dashpots_are_ours(material, pairs):
    """Forces written as LAMMPS's sources have them, at an overlap, against the laws here."""
    whole = mass(material)
    for p, m in zip(pairs, (whole / 2, whole), strict=True):
        overlap, e = 1e-5, p.contact.restitution
        a = math.sqrt(p.radius * overlap)
        normal, sideways = (
            numbers("lammps", *law, p) for law in (("normal", "hertz"), ("tangential", "mindlin"))
        )
        theirs = normal["k"] * math.sqrt(p.radius) * overlap**1.5
        assert normal["e"] == e
        assert theirs == pytest.approx(4 / 3 * p.young * math.sqrt(p.radius) * overlap**1.5)
        beta = -math.log(e) / math.hypot(math.log(e), math.pi)
        eta_n = math.sqrt(1.5) * 2 * math.sqrt(5 / 6) * beta * math.sqrt(m * theirs / overlap)
        assert eta_n == pytest.approx(factor(e) * math.sqrt(2 * p.young * a * m))
        eta_t = factor(e) * math.sqrt(8 * p.shear * a * m)
        assert sideways["x"] * eta_n == pytest.approx(eta_t)
        assert sideways["k"] * a == pytest.approx(8 * p.shear * a)


def test_lammps_rolling_spring_has_the_torque_of_ours(pairs):
    """sds: torque R* k R* angle below the limit, R* mu F at it."""
    for p in pairs:
        theirs = rolls("lammps", p)
        assert theirs["k"] * p.radius**2 == pytest.approx(spring_of(p))
        assert theirs["gamma"] * p.radius**2 == pytest.approx(dashpot_of(p, spring_of(p)))
        assert theirs["mu"] == p.contact.rolling_friction


# --- YADE -----------------------------------------------------------------------------------------


def test_yade_limit_of_the_moment_is_ours(material, pairs):
    """eta (R1 + R2)/2 F against mu_r R* F of two equal grains; at a wall, where a facet counts as a
    sphere of twice the radius, the smaller radius times a number of its own."""
    r, (grains, wall) = material.radius, pairs
    limit = grains.contact.rolling_friction * grains.radius
    assert rolls("yade", grains)["eta"] * (r + r) / 2 == pytest.approx(limit)
    limit = wall.contact.rolling_friction * wall.radius
    assert rolls("yade", wall)["maxBendPl"] * min(2 * r, r) == pytest.approx(limit)
    assert rolls("yade", wall)["krot"] == spring_of(wall)


def test_yade_block_is_python_with_the_friction_angles(material, mapping):
    text = yade.block(material, conversion(mapping), ["where from"])
    ast.parse(text)
    angles = [float(x) for x in re.findall(r"frictionAngle=([\d.]+)", text)]
    assert math.tan(angles[0]) == pytest.approx(MU_S, rel=1e-5)
    assert math.tan(angles[1]) == pytest.approx(0.71, rel=1e-5)


# --- MercuryDPM -----------------------------------------------------------------------------------


def test_mercury_forces_are_ours(material, pairs):
    """Forces as MercuryDPM's sources have them, at an overlap, against the laws here."""
    whole = mass(material)
    for p, m in zip(pairs, (whole / 2, whole), strict=True):
        a, e = math.sqrt(p.radius * 1e-5), p.contact.restitution
        log2 = math.log(e) ** 2
        theirs = math.sqrt(5 * log2 / (log2 + math.pi**2)) * math.sqrt(m * 4 / 3 * p.young * a)
        assert theirs == pytest.approx(factor(e) * math.sqrt(2 * p.young * a * m))
        sideways = numbers("mercurydpm", "tangential", "mindlin", p)
        zero = 8 * sideways["EffectiveShearModulus"] * a
        assert 2 / 3 * zero == pytest.approx(8 * p.shear * a)
        dashpot = sideways["SlidingDissipation"] * math.sqrt(m * zero)
        assert dashpot == pytest.approx(factor(e) * math.sqrt(8 * p.shear * a * m))
        rolling, mu_r = rolls("mercurydpm", p), p.contact.rolling_friction
        lever = 2 * p.radius
        assert lever * rolling["RollingFrictionCoefficient"] == pytest.approx(mu_r * p.radius)
        c = rolling["RollingDissipation"] * lever**2
        k_r = 8 * sideways["EffectiveShearModulus"] * p.contact_radius * lever**2
        assert c == pytest.approx(2 * 0.3 * math.sqrt(p.inertia * k_r))


def test_mercury_block_is_well_formed(material, mapping):
    """No compiler's check: braces, statements and setters that its sources have."""
    text = mercurydpm.block(material, conversion(mapping), ["where from"])
    code = [x for x in text.splitlines() if x and not x.startswith("//")]
    joined = " ".join(code)
    assert joined.count("(") == joined.count(")")
    statements = [x.strip() for x in joined.split(";") if x.strip()]
    known = re.compile(r"(auto \w+ =|\w+(->|\.)set\w+\(|Hertzian\w+ \w+$|setTimeStep\()")
    assert all(map(known.match, statements))
    setters = set(re.findall(r"->(set\w+)\(", joined))
    assert setters == {
        "setEffectiveElasticModulusAndRestitutionCoefficient",
        "setEffectiveShearModulus",
        "setSlidingDissipation",
        "setSlidingFrictionCoefficient",
        "setRollingFrictionCoefficient",
        "setRollingDissipation",
        "setTorsionFrictionCoefficient",
    }


# --- EDEM -----------------------------------------------------------------------------------------


def test_edem_takes_the_calibrated_numbers_as_they_are(material, mapping):
    text = by_hand.block("edem", material, conversion(mapping), ["where from"])
    assert "standard rolling friction" in text
    assert tells(text, "rolling friction", f"{OPTIMUM['salt_salt_rolling_friction']:.6g}")
    assert tells(text, "Shear modulus", "3e+06", "Pa")
    assert all(line.count("|") == 4 for line in text.splitlines() if line.startswith("|"))


def test_edem_type_c_prints_the_spring_and_its_damping(mapping):
    """Its damping ratio is about the contact point as here; its factor is fixed at 2.25, ours may
    differ."""
    chosen = {"rolling_stiffness_factor": 1.5, "rolling_damping_ratio": 0.2}
    for parameters, stiffness, eta in (({}, 2.25, 0.3), (chosen, 1.5, 0.2)):
        changes = {"laws": {"rolling": "elastic_plastic"}, "law_parameters": parameters}
        text = typed("edem", parse_spec(overlay(mapping, changes)))
        assert tells(text, "viscous damping", str(eta))
        assert tells(text, "rolling stiffness", str(stiffness))
        assert ("NOT CONVERTED" in text) == (stiffness != 2.25)


KNOWN = {
    "contacts.particle_particle.rolling_friction": {
        "source": "calibrated",
        "interval_95_others_held": [0.19, 0.31],
        "not_bounded_by_the_data": ["high"],
    },
    "materials.particle.shear_modulus_Pa": {
        "value": 3e6, "source": "the configuration's run spec", "paper": "1.1: 1.9e+09"
    },
}  # fmt: skip
HEAP = EXPECTED | {"low": 42.3, "high": 48.0}


@pytest.mark.parametrize(
    ("code", "name"),
    [("edem", "Coefficient of rolling friction"), ("rocky", "Rolling resistance")],
)
def test_a_page_to_type_in_has_interval_mark_source_and_the_angle(code, name, material, mapping):
    text = by_hand.block(code, material, conversion(mapping), [], KNOWN, HEAP)
    assert tells(text, "40.00", "10")
    assert tells(text, "42.30", "48.00")
    line = next(row for row in text.splitlines() if row.startswith(f"| {name} |") and "0.19" in row)
    assert tells(line, "0.19", "0.31", "calibrated", by_hand.OPEN, "above")
    assert tells(text, "3e+06", "1.9e+09")


def test_edem_states_the_whole_rig(mapping):
    """Heights by trigonometry: the mouth stands (R - r) / tan(half angle) above the orifice."""
    spec = overlay(mapping, {"particles": {"count": 500, "sizes": SIEVED},
                             "geometry": {"funnel_half_angle_deg": 45}})  # fmt: skip
    spec = parse_spec(spec)
    text = typed("edem", spec)
    rows, g = rows_in(text), spec.geometry
    up = 0.5 * (g.funnel_top_diameter_mm - g.orifice_diameter_mm)
    assert float(rows["Funnel: mouth, z"][0]) == pytest.approx(g.discharge_height_mm + up)
    assert float(rows["Total number"][0]) == 500
    assert float(rows["Velocity: fixed, z"][0]) == -g.injection_speed_m_s
    [share] = [cells[0] for name, cells in rows.items() if "Rayleigh" in name]
    assert float(share) == pytest.approx(1e2 * spec.numerics.rayleigh_fraction)
    assert tells(text, "3 mm: 0.5", "4 mm: 0.5", "mass")


def test_rocky_says_what_it_cannot_take(mapping):
    """Its manual has one rolling resistance for a particle, and no type C with a dashpot."""
    for law, lost in (("none", 0), ("constant_torque", 1), ("elastic_plastic", 2)):
        spec = parse_spec(overlay(mapping, {"laws": {"rolling": law}}))
        text = typed("rocky", spec)
        assert text.count("NOT CONVERTED") == lost
        assert (f"{spec.contacts.particle_wall.rolling_friction:.6g}" in text) == (lost > 0)


def test_lammps_alone_takes_the_torsion_along(mapping):
    laws = {"torsion": "marshall", "rolling": "elastic_plastic"}
    plain, twisting = (parse_spec(overlay(mapping, m)) for m in ({}, {"laws": laws}))
    for code, keeps in ((lammps, True), (liggghts, False), (yade, False), (mercurydpm, False)):
        for spec in (plain, twisting):
            text = code.block(Granulate(spec), Conversion(spec), [])
            assert ("twisting marshall" in text) == (keeps and spec is twisting)
            lost = "NOT CONVERTED: torsion" in uncommented(text)
            assert lost == (not keeps and spec is twisting)
    assert "NOT CONVERTED: torsion" in typed("edem", twisting)


# --- what an export says --------------------------------------------------------------------------


def test_a_law_calibrated_with_keeps_its_number(mapping):
    law = {"laws": {"rolling": "elastic_plastic"},
           "law_parameters": {"rolling_stiffness_factor": 3.0}}  # fmt: skip
    spec = parse_spec(overlay(mapping, law))
    assert not rolling.needs_search(spec)
    c = Conversion(spec)
    assert c.numbers["rolling_friction"] == spec.contacts.particle_particle.rolling_friction
    assert c.numbers["stiffness_factor"] == 3.0
    assert "NOT CONVERTED" not in " ".join(c.sentences("epsd3"))


def test_no_search_where_nothing_rolls(mapping, tmp_path):
    free = overlay(mapping, {"laws": {"rolling": "none"}})
    assert not rolling.needs_search(parse_spec(free))
    rolling.plan_scan(free, PlanFiles.of(tmp_path))
    assert json.loads((tmp_path / "plan.json").read_text()) == {}
    scan = pd.read_csv(tmp_path / "design.csv").assign(response=[])
    rolling.plan_confirmation(free, scan, PlanFiles.of(tmp_path / "c"))
    nothing = rolling.Evidence(scan, scan, pd.Series([45.0, 45.2]), 1.0)
    rolling.plan_correction(free, nothing, PlanFiles.of(tmp_path / "d"))
    for folder in ("c", "d"):
        assert len(pd.read_csv(tmp_path / folder / "design.csv")) == 0


def test_a_study_without_a_heap_says_that_rolling_friction_is_not_converted(mapping):
    drop = parse_spec(
        {k: v for k, v in mapping.items() if k in ("materials", "laws", "contacts")}
        | {"experiment": "drop"}
    )
    assert not rolling.needs_search(drop)
    c = Conversion(drop, {"path": None})
    assert "Without a heap" in c.sentences("epsd3")[0]
    assert c.numbers["rolling_friction"] == pytest.approx(OPTIMUM["salt_salt_rolling_friction"])


def test_an_export_says_when_the_angle_cannot_be_reached(material, mapping):
    text = liggghts.block(material, conversion(mapping, reached=False), [])
    assert "OUT OF REACH" in text
    assert tells(" ".join(text.replace("#", "").split()), "Calibrating", "law")


@pytest.mark.parametrize(
    ("code", "held"),
    [
        (liggghts, "integrator string nve\n"),
        (lammps, "integrator string nve\n"),
        (yade, 'blockedDOFs, b.state.angVel = "XYZ"'),
        (mercurydpm, "setRotation(false);"),
    ],
)
def test_grains_that_do_not_turn_are_held_in_every_code(material, mapping, code, held):
    text = code.block(material, conversion(mapping, **HELD), [])
    assert held in text
    told = uncommented(text)
    assert tells(told, "NOT TURN")
    assert "OUT OF REACH" not in told
    assert held not in code.block(material, conversion(mapping), [])
    number = f"{math.atan(MU_HELD):.6g}" if code is yade else f"{MU_HELD:.6g}"
    assert number in text
    for word in ("epsd3", "rolling sds", "krot", "wallRolling"):
        body = [x for x in text.splitlines() if not x.startswith(("#", "//"))]
        assert word not in "\n".join(body)


def test_an_export_says_that_clumps_become_spheres(mapping):
    clump = {"x_mm": [0, 1], "y_mm": [0, 0], "z_mm": [0, 0], "radius_mm": [1, 1]}
    told = " ".join(written.left_out(parse_spec(overlay(mapping, {"particles": {"clump": clump}}))))
    assert tells(told, "NOT CONVERTED", "2", "spheres")


# --- the search -----------------------------------------------------------------------------------


def test_the_path_ends_where_sliding_comes_before_rolling():
    """mu_r R* F_n = mu_s R F_n: the torque that holds a grain is all that friction can turn it
    with."""
    pair = ContactSpec(rolling_friction=0.27, static_friction=0.68)
    path = "elastic_plastic"
    assert rolling.place(path, 0.0, pair) == (0.27, 0.68)
    assert rolling.place(path, 1.0, pair)[0] * 0.5 == pytest.approx(0.68)
    assert rolling.place(path, -0.25, pair)[0] < 0.27
    assert rolling.place(path, 0.5, pair)[0] == pytest.approx(math.sqrt(0.27 * 1.36), rel=1e-5)
    rough = ContactSpec(rolling_friction=3.0, static_friction=4.0)
    assert rolling.place(path, 1.0, rough)[0] == rolling.MOST_ROLLING


def test_grains_that_do_not_turn_have_more_rolling_friction_than_static(mapping):
    """mu_r F R of the own spin holds whatever mu_s F R can turn, on grains and on walls."""
    spec = parse_spec(rolling.on_path(mapping, "no_rotation", 0.6))
    pair, wall = spec.contacts.particle_particle, spec.contacts.particle_wall
    calibrated = parse_spec(mapping).contacts
    assert pair.static_friction == pytest.approx(
        0.6 * calibrated.particle_particle.static_friction, rel=1e-5
    )
    assert wall.static_friction == calibrated.particle_wall.static_friction
    assert spec.laws.rolling == "constant_torque"
    for contact in (pair, wall):
        assert contact.rolling_friction > 2.0 * contact.static_friction


def scan(**angles):
    """Table of a scan: two runs at each place, about the angles given by path."""
    rows = [
        {"path": path, "share": share, "response": angle + e}
        for path, values in angles.items()
        for share, angle in zip(rolling.PATHS.get(path, [0.0] * len(values)), values, strict=True)
        for e in (-0.2, 0.2)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("calibrated", "path", "reached"),
    [
        (33.0, "elastic_plastic", True),
        (41.0, "no_rotation", True),
        (70.0, "elastic_plastic", False),
    ],
)
def test_the_search_takes_the_first_path_that_comes_to_the_angle(calibrated, path, reached):
    runs = scan(
        calibrated=[calibrated],
        elastic_plastic=[23.2, 26.6, 29.5, 31.0, 34.3],
        no_rotation=[28.0, 36.0, 44.0, 52.0, 61.0],
    )
    taken, found = rolling.search(runs)
    assert (taken, found[taken].reached) == (path, reached)
    if path == "no_rotation":
        assert found[taken].share == pytest.approx(0.4 + 0.2 * 5 / 8)


def test_heaps_of_the_search_without_a_value_are_left_out_and_told(mapping):
    """Every heap at one place of a path clogs, and one of each other kind: the curve is known."""
    runs = scan(
        calibrated=[33.0, 33.0],
        elastic_plastic=[23.0, 26.0, 29.0, 32.0, 35.0],
        no_rotation=[28.0, 36.0, 44.0, 52.0, 61.0],
    )
    lost = (runs["path"] == "elastic_plastic") & (runs["share"] == 0.6667)
    lost |= ~runs[["path", "share"]].duplicated() & (runs["path"] != "elastic_plastic")
    without = runs.assign(response=runs["response"].mask(lost))
    path, places = rolling.search(without)
    assert path == "elastic_plastic"
    assert places[path].share == pytest.approx(0.3333 + 0.6667 * (33.0 - 29.0) / 6.0, abs=0.03)
    confirmation = pd.DataFrame({"scale": "coarse", "response": [33.1, np.nan, 32.8]})
    spec, validated = parse_spec(mapping), pd.Series([33.0, np.nan, 33.2])
    evidence = rolling.Evidence(without, confirmation, validated, 2.0)
    told = rolling.conclude(spec, evidence, confirmation.iloc[:0], "deg")
    assert (told["without_value"], told["runs"]) == (int(lost.sum()) + 1, len(runs) + 3)
    assert told["coarse"]["runs"] == 2
    assert "full" not in told
    said = " ".join(Conversion(spec, told).sentences("epsd3"))
    assert tells(said, f"{told['without_value']} of {told['runs']}", "no angle")
    same = (without["path"] == "elastic_plastic") & (without["share"] == 0.0)
    clogged = without.assign(response=without["response"].mask(same))
    told = rolling.conclude(spec, replace(evidence, scan=clogged), confirmation.iloc[:0], "deg")
    said = " ".join(Conversion(spec, told).sentences("epsd3"))
    assert tells(said, "same number", "no heap")


def evidence(full, own=(45.0, 45.2, 44.8), coarse_own=41.0):
    """A search whose grains must not turn, at share 0.525, and heaps of it on the study's scale."""
    runs = scan(
        calibrated=[coarse_own] * 2,
        elastic_plastic=[23.2, 26.6, 29.5, 31.0, 34.3],
        no_rotation=[28.0, 36.0, 44.0, 52.0, 61.0],
    )
    rows = [{"scale": "full", "share": 0.525, "response": y} for y in full]
    found = pd.DataFrame(rows, columns=["scale", "share", "response"])
    return rolling.Evidence(runs, found, pd.Series(own), 1.0)


def moved(mapping, found, folder):
    """The design of the correction."""
    rolling.plan_correction(mapping, found, PlanFiles.of(folder))
    return pd.read_csv(folder / "design.csv")


def test_a_number_that_misses_at_the_studys_own_grains_is_moved_by_what_is_missing(
    mapping, tmp_path
):
    """The path rises by 40 degrees for a share of 1 here: 4 degrees are a tenth."""
    found = evidence(full=[40.9, 41.1, 41.0])
    design = moved(mapping, found, tmp_path)
    assert len(design) == rolling.FULL_SEEDS
    assert set(design["scale"]) == {"full"}
    assert design["share"].tolist() == pytest.approx([0.525 + 0.1] * rolling.FULL_SEEDS, abs=1e-4)
    specs = json.loads((tmp_path / "plan.json").read_text())
    static = parse_spec(mapping).contacts.particle_particle.static_friction
    for name in design["run_id"]:
        pair = parse_spec(specs[name]).contacts.particle_particle
        assert pair.static_friction == pytest.approx(0.625 * static, rel=1e-4)

    correction = design.assign(response=[45.1, 44.9, 45.0, 45.2, 44.8])
    told = rolling.conclude(parse_spec(mapping), found, correction, "deg")
    assert told["static_friction"] == pytest.approx(0.625 * static, rel=1e-4)
    assert told["full"]["difference"] == pytest.approx(0.0, abs=1e-9)
    assert told["searched"]["static_friction"] == pytest.approx(0.525 * static, rel=1e-4)
    assert told["searched"]["full"]["difference"] == pytest.approx(-4.0)
    said = " ".join(Conversion(parse_spec(mapping), told).sentences("epsd3"))
    assert tells(said, "the study", "41.00", "-4.00")
    assert tells(said, "the study", "45.00 deg", "0.00")


@pytest.mark.parametrize(
    "full",
    [[44.1, 44.3, 44.2], [38.0, 44.0, 47.0], [41.0], []],
    ids=["within the margin", "within the scatter", "one heap", "no heap"],
)
def test_a_number_that_is_not_shown_to_miss_stays(mapping, tmp_path, full):
    found = evidence(full)
    correction = moved(mapping, found, tmp_path)
    assert correction.empty
    told = rolling.conclude(parse_spec(mapping), found, correction.assign(response=[]), "deg")
    assert "searched" not in told
    assert ("full" in told) == (len(full) > 1)


@pytest.mark.parametrize("path", [rolling.CALIBRATED, *rolling.PATHS])
def test_a_search_in_which_a_path_has_no_angle_gets_a_sentence(path):
    runs = scan(calibrated=[33.0], **{p: [25.0] * 5 for p in rolling.PATHS})
    runs["response"] = runs["response"].mask(runs["path"] == path)
    with refused(CalibrationError, path):
        rolling.search(runs)


def test_an_angle_above_the_path_takes_the_smallest_number_as_good_as_the_best():
    """Means 25, 29, 33.5, 34, 33 with a standard error of 1/sqrt(2): 33.5 cannot be told from
    34."""
    shares = np.repeat(PATH, 2)
    angles = np.repeat([25.0, 29.0, 33.5, 34.0, 33.0], 2) + np.tile([0.5**0.5, -(0.5**0.5)], 5)
    found = rolling.invert(shares, angles, 45.0)
    assert (found.share, found.reached) == (0.3333, False)
    assert (found.smallest, found.largest) == (pytest.approx(25.0), pytest.approx(34.0))
    certain = rolling.invert(shares, np.repeat([25.0, 29.0, 33.5, 34.0, 33.0], 2), 45.0)
    assert certain.share == 0.6667


def test_the_search_runs_the_same_volume_of_fewer_grains(mapping):
    coarse, spec = parse_spec(rolling.coarse(mapping)), parse_spec(mapping)

    def volume(s):
        return s.particles.count * (s.particles.diameter_mm * s.particles.scale_factor) ** 3

    assert coarse.particles.count == rolling.MOST_GRAINS
    assert volume(coarse) == pytest.approx(volume(spec), rel=1e-5)
    poured = spec.particles.count / spec.geometry.generation_rate_per_s
    assert coarse.particles.count / coarse.geometry.generation_rate_per_s == pytest.approx(poured)
    narrow = overlay(mapping, {"geometry": {"orifice_diameter_mm": 7.0}})
    assert rolling.coarse(narrow) is narrow


def test_the_scan_is_planned_law_by_law_with_new_seeds(mapping, tmp_path):
    rolling.plan_scan(mapping, PlanFiles.of(tmp_path))
    design, plan = (
        pd.read_csv(tmp_path / "design.csv"),
        json.loads((tmp_path / "plan.json").read_text()),
    )
    assert set(design["path"]) == {"calibrated", *rolling.PATHS}
    places = sum(len(shares) for shares in rolling.PATHS.values())
    assert len(plan) == len(design) == rolling.OWN_SEEDS + places * rolling.PATH_SEEDS
    for row in design.itertuples():
        spec = parse_spec(plan[row.run_id])
        assert (spec.laws.rolling == "elastic_plastic") == (row.path == "elastic_plastic")
        pair = spec.contacts.particle_particle
        assert pair.rolling_friction == pytest.approx(row.rolling_friction)
        assert pair.static_friction == pytest.approx(row.static_friction)


# --- calibrated.yaml ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(config, tmp_path_factory):
    out = tmp_path_factory.mktemp("export")
    study = _study(config, out, export_correction={"rolling.json": found()})
    _export(study, out)
    converted = Files(file=out / "exports" / "converted" / "any")
    stage.export_converted(study, SOURCE, converted)
    return out


def _study(config, out, **more):
    """The reference study with further files of stages {stage: {file: content}}."""
    folder = out / "study"
    folder.mkdir()
    for name in ("optimise", "validation", "response_surface"):
        (folder / name).symlink_to(REFERENCE.resolve() / name)
    for name, files in more.items():
        (folder / name).mkdir()
        for file, content in files.items():
            (folder / name / file).write_text(json.dumps(content))
    return Study(config, folder)


def _export(study, out, runs=None):
    region = read_region(REFERENCE / "response_surface" / "region.json")
    runs = study.table("response_surface", "runs") if runs is None else runs
    optimum = study.summary("optimise")
    written.write_exports(
        study, stage._spec(study, SOURCE), *stage.by_chain(optimum, runs, region), out
    )


def test_a_run_that_was_lost_widens_what_is_exported(config, files, tmp_path):
    """The interval is of the surface through the other runs: the same as without the row."""
    study = _study(config, tmp_path)
    runs, out = study.table("response_surface", "runs"), (tmp_path / "lost", tmp_path / "without")
    lost = runs["run"] == 3
    for folder, table in zip(out, (runs.assign(response=runs["response"].mask(lost)), runs[~lost]),
                             strict=True):  # fmt: skip
        folder.mkdir()
        _export(study, folder, table)
    one, other = ((folder / "calibrated.yaml").read_text() for folder in out)
    assert one == other
    whole, fewer = (
        yaml.safe_load(text)["parameters"]["contacts.particle_particle.rolling_friction"]
        for text in ((files / "calibrated.yaml").read_text(), one)
    )
    assert fewer["interval_95_others_held"] != whole["interval_95_others_held"]


def test_every_parameter_has_value_unit_and_source(files):
    data = yaml.safe_load((files / "calibrated.yaml").read_text())
    for key, entry in data["parameters"].items():
        assert entry["value"] is not None, key
        assert "source" in entry, key
        if not isinstance(entry["value"], (str, list)):
            assert entry["unit"] == in_ascii(unit_of(key)), key
    spec = load_spec(files / "exports" / "dem.yaml")
    for part in ("materials", "contacts", "laws", "law_parameters"):
        for key, value in _leaves(getattr(spec, part), part):
            if value is not None:
                assert data["parameters"][key]["value"] == pytest.approx(value), key


def _leaves(part, prefix):
    for name in type(part).model_fields:
        value = getattr(part, name)
        if hasattr(type(value), "model_fields"):
            yield from _leaves(value, f"{prefix}.{name}")
        else:
            yield f"{prefix}.{name}", value


def test_sources_are_told_apart(files):
    p = yaml.safe_load((files / "calibrated.yaml").read_text())["parameters"]
    optimum = json.loads((REFERENCE / "optimise" / "optimum.json").read_text())
    mu = p["contacts.particle_particle.rolling_friction"]
    assert mu["source"] == "calibrated"
    assert mu["value"] == pytest.approx(optimum["optimum"]["salt_salt_rolling_friction"])
    assert mu["interval_95_others_held"][0] < mu["value"] < mu["interval_95_others_held"][1]
    wall = p["contacts.particle_wall.static_friction"]
    assert wall["source"] == sources.FIXED
    assert wall["paper"] == "2.3.2: the same"
    assert p["laws.rolling"]["source"] == sources.SPEC
    assert p["numerics.precision"]["source"] == sources.DEFAULT
    assert p["materials.particle.shear_modulus_Pa"]["paper"] == "1.1: 1.9e+09"


def test_a_clump_of_a_file_is_the_study_s_own(mapping, tmp_path):
    rows = "x_mm,y_mm,z_mm,radius_mm\n-1,0,0,1\n1,0,0,1\n"
    (tmp_path / "clump.csv").write_text(rows)
    run = overlay(mapping, {"particles": {"clump": {"file": str(tmp_path / "clump.csv")}}})
    published = SimpleNamespace(tables={}, names={})
    config = SimpleNamespace(own_run=run, fixed={}, published=published)
    study = SimpleNamespace(config=config, factors=[], bench_levels=dict)
    found = sources.known_parameters(study, parse_spec(run), {})
    assert found["particles.clump.x_mm"]["value"] == [-1.0, 1.0]
    assert found["particles.clump.x_mm"]["source"] == sources.SPEC
    assert found["particles.elongation"]["source"] == sources.DEFAULT


def test_a_level_of_a_bench_test_is_said_to_be_one(config, tmp_path):
    found = {"fixed.json": {"fixed": {"salt_poisson_ratio": 0.3}}}
    own = config.model_copy(update={"fixed_from": "bench"})
    _export(_study(own, tmp_path, bench=found), tmp_path)
    found = yaml.safe_load((tmp_path / "calibrated.yaml").read_text())["parameters"]
    assert found["materials.particle.poisson_ratio"]["source"] == "bench test"
    assert found["contacts.particle_wall.static_friction"]["source"] == sources.FIXED


def test_target_and_validation_are_those_of_the_study(files):
    data = yaml.safe_load((files / "calibrated.yaml").read_text())
    validation = json.loads((REFERENCE / "validation" / "validation.json").read_text())
    assert data["target"]["measured_mean"] == pytest.approx(validation["measured_mean"])
    assert data["validated"]["mean"] == pytest.approx(validation["simulated_mean"])
    assert data["validated"]["difference_interval_95"] == pytest.approx(
        [validation["difference_low"], validation["difference_high"]]
    )
    assert re.fullmatch("[0-9a-f]{16}", data["engine"])


def test_the_study_written_out_is_the_configuration(files, config):
    assert parse_config(read_mapping(files / "exports" / "study.yaml")[0]) == config


DECK = {"README.md", "check.py", "expected.json", "spec.yaml"}
OWN_FILES = {
    "liggghts": {"in.liggghts", "material.in", "plate.stl", "funnel.stl"},
    "lammps": {"in.lammps", "material.lammps", "grain.molecule"},
}


@pytest.mark.parametrize("code", DECKS)
def test_a_deck_is_whole_and_says_how_it_is_checked(files, code):
    for folder in ("exports", "exports/converted"):
        deck = files / folder / code
        assert {p.name for p in deck.iterdir()} == DECK | OWN_FILES[code]
        text = (deck / "README.md").read_text()
        assert "python check.py" in text
        first = text.split("\n\n")[1]
        for name in ("NOT CORRECTED", "deg"):
            assert name in " ".join(first.split())
        # no heaps with the numbers of this study's search were tried
        assert ("MISSES" in first) == (folder == "exports")
        expected = json.loads((deck / "expected.json").read_text())
        assert f"{expected['margin']:g} deg" in first
        assert f"{expected['mean']:.2f} deg" in text
        for name in DECK | OWN_FILES[code]:
            assert f"`{name}`" in text or name == "README.md"
        named = re.findall(r"^include (\S+)", (deck / f"in.{code}").read_text(), re.M)
        assert all((deck / name).is_file() for name in named)
        [material] = [(deck / name).read_text() for name in named]
        assert ("NOT CONVERTED: rolling" in " ".join(material.split())) == (folder == "exports")


@pytest.mark.parametrize(
    ("changes", "words", "codes"),
    [
        ({"particles": {"sizes": SIEVED}}, "", set()),
        ({"particles": {"elongation": 1.5}}, "long as wide", {"lammps", "liggghts"}),
        (STICKY, "cohesion", {"lammps"}),
        ({"laws": {"drag": "schiller_naumann"}}, "drag", {"lammps", "liggghts"}),
        ({"geometry": {"funnel_stl": "dish.stl"}}, "funnel_stl", {"lammps", "liggghts"}),
    ],
)
def test_what_a_code_cannot_represent_is_named_in_place_of_a_deck(
    mapping, tmp_path, changes, words, codes
):
    spec = parse_spec(overlay(mapping, changes))
    write_decks(spec, Conversion(spec), [], EXPECTED, tmp_path)
    for code in DECKS:
        text = (tmp_path / code / "README.md").read_text()
        refused = code in codes
        assert ("NOT WRITTEN" in text and words in text) == refused
        assert (tmp_path / code / f"in.{code}").exists() != refused


def test_a_page_states_what_one_heap_scatters():
    """The 95 % prediction interval of one more heap after ten."""
    assert scatter_of_one({"sd": 0.5, "runs": 10}) == pytest.approx(
        2.262 * 0.5 * math.sqrt(1.1), abs=1e-3
    )


@pytest.mark.parametrize("name", written.CONVERTED)
def test_a_block_has_the_number_of_the_search_only_where_it_is_converted(files, name):
    plain = (files / "exports" / name).read_text()
    assert "NOT CONVERTED" in plain
    converted = (files / "exports" / "converted" / name).read_text()
    assert "NOT CONVERTED" not in converted
    assert f"mu_r = {MU_R:.4g} below" in uncommented(converted)


def test_the_interval_of_a_straight_line_is_the_textbook_one():
    """One factor that matters, no curvature: half width t se(point)/slope where the error hardly
    changes."""
    rng = np.random.default_rng(3)
    design = pd.DataFrame(
        [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) for _ in range(60)], columns=["A", "B"]
    )
    y = 40.0 + 4.0 * design["A"] + rng.normal(0, 0.5, len(design))
    surface = fit_surface(design, ["A", "B"], y, terms=[(), ("A",), ("B",)])
    target = float(surface.predict([[0.0, 0.0]])[0])
    low, high = parameter_interval(surface, target, [0.0, 0.0], 0)
    half = 1.96 * float(surface.standard_error([[0.0, 0.0]])[0]) / 4.0
    assert high == pytest.approx(half, rel=0.05)
    assert low == pytest.approx(-half, rel=0.05)
    assert parameter_interval(surface, target, [0.0, 0.0], 1) == (-1.0, 1.0)


@pytest.mark.parametrize("value", [1e7, 8e10, 0.1, 1e-9, 3.0, -2.5e-6, 123456.789])
def test_numbers_come_back_from_yaml_as_numbers(value):
    assert yaml.safe_load(to_yaml({"x": value}))["x"] == pytest.approx(value, rel=1e-8)
