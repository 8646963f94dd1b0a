"""A study of all that a laboratory measured: which rigs, targets, laws and ranges its answers
become, and where each of them went."""

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from statistics import fmean

from calibration.errors import CalibrationError
from calibration.intake.tables import summary
from calibration.study.config.schema import COARSER
from calibration.study.factors import Factor, factor_of
from calibration.study.new.assumed import ASSUMED
from calibration.study.new.grains import (
    Grains,
    clump_of_axes,
    energy_of_weight,
    mean_diameter,
    sieve_curve,
    size_distribution,
)
from calibration.study.new.methods import Entry, LaboratoryTest, function_of
from calibration.study.new.methods.contacts import EXPERIMENT as SLID_ON_A_WALL
from calibration.study.new.methods.declare import refusal, said
from calibration.study.new.methods.heaps import QUICK_WIDER, steady_fraction
from dem.advice import bed_pressure
from dem.constants import GRAVITY
from dem.contact.registry import Material
from dem.experiments import experiments
from dem.tables import table_of
from dem.units import behind, has_unit, unit_of

WIDTHS = (
    "cylinder_diameter_mm", "simulated_diameter_mm", "vessel_diameter_mm", "silo_diameter_mm",
    "ring_diameter_mm",
)  # fmt: skip
"""Keys of the rigs that are filled in layers; the first that a rig has is its width."""
FORMS = {"heap": ASSUMED.heap_bond, "lifted_cylinder": ASSUMED.cylinder_bond}
COHESION = "law_parameters.surface_energy_J_m2"
WALL_COHESION = "law_parameters.wall_surface_energy_J_m2"
PUBLISHED = table_of(files("calibration.study.new").joinpath("published.csv").read_text("utf-8"))
CLUMP = "clump.csv"
"""The file of a grain's spheres, in the study's folder."""


@dataclass(frozen=True)
class Laboratory:
    """All that a study is made of; its chain is calibrated to the target of the first test."""

    name: str
    folder: Path
    grains: Grains
    tests: list[LaboratoryTest]
    factors: list[Factor]
    given: list[dict]
    said: list[str]

    @property
    def alone(self) -> bool:
        """Return whether a heap of dry grains is all that was measured: the chain calibrates to
        it."""
        return [t.experiment for t in self.tests] == ["heap"] and not self.grains.sticky


def laboratory_of(
    name: str, folder: Path, entries: Sequence[Entry], most: int | None = None, single: bool = False
) -> Laboratory:
    """`Laboratory` of a study's name and new folder; most: grains that are simulated at most;
    single: whether one reading with its spread is enough. Raises CalibrationError for what no study
    can be made of, all faults at once."""
    if most is not None and most < ASSUMED.fewest_grains:
        raise refusal("few_grains", most, ASSUMED.fewest_grains)
    tested = sorted((e for e in entries if e.method.becomes), key=lambda e: e.method.rank)
    if most is None and [e.method.name for e in tested] == ["funnel"]:
        most = ASSUMED.most_grains
    grain, shape, chosen = _grains(folder, entries, most)
    _refuse_without_lead(tested, single)
    material = next((e.value("material") for e in entries if e.values("material")), None)
    factors = factors_of(material)
    bounce = factor_of(factors, "contacts.particle_particle.restitution")
    modulus = stiff_enough(tested)
    grain = replace(grain, least_restitution=bounce.low, shear_modulus_Pa=modulus)
    tests, grain = _tests(tested, grain)
    thrown = max((uncrushed(t, grain) for t in tests), default=0.0)
    if thrown > modulus:
        modulus = float(f"{thrown:.1e}")
        grain = replace(grain, shear_modulus_Pa=modulus)
        tests, grain = _tests(tested, grain)
        chosen += said("not_squeezed", modulus)
    elif modulus > ASSUMED.softened_Pa:
        chosen += said("not_dented", modulus, ASSUMED.deepest)
    _refuse_two_walls(tests)
    _refuse_looser_when_tapped(tested)
    _refuse_falling_stress(tested)
    measured = _measured_ranges(tests)
    factors = [_ranged(f, measured, grain) for f in factors] + _cohesion(grain, tests)
    given = [row for e in entries for row in _went(e, tests, tested, shape)]
    read = [(e, q) for e in tested for q in e.method.readings if len(e.values(q.key)) > 1]
    sentences = [
        f"{e.method.title}: {summary(e.values(q.key), behind(unit_of(q.unit)))}" for e, q in read
    ]
    sentences += [*chosen, *(s for t in tests for s in t.said)]
    if grain.sticky:
        sentences += said("sticky", grain, grain.enlarged(grain.common_mm))
    for e, q in read:
        low, high = min(e.values(q.key)), max(e.values(q.key))
        if high > ASSUMED.far_apart * low:
            sentences += said("far_apart", low, high, behind(unit_of(q.unit)))
    return Laboratory(name, folder, grain, tests, factors, given, list(dict.fromkeys(sentences)))


def _grains(folder, entries, most):
    """(`Grains`, {question's key: where it went}, sentences) of the entries that describe the
    grain."""
    own = {e.method.name: e for e in entries if not e.method.becomes}
    if "grain" not in own or not own["grain"].values("density"):
        raise refusal("no_density")
    grain = own["grain"]
    sized = [n for n in ("axes", "sieve") if n in own] + (
        ["diameter"] if grain.values("diameter") else []
    )
    if len(sized) != 1:
        raise refusal("sizes", sized)
    density = grain.value("density")
    moist = grain.value("moisture")
    shared = {"density_kg_m3": density, "moist": None if moist is None else moist == "moist"}
    shared |= {} if most is None else {"most": most}
    if "sieve" in own:
        return _of_sieves(own["sieve"], shared)
    if "axes" in own:
        return _of_axes(folder, own["axes"], shared)
    return Grains(grain.value("diameter"), **shared), {"diameter": "the grains' diameter"}, ()


def _of_sieves(entry, shared):
    if bool(entry.values("file")) == bool(entry.values("size")):
        raise refusal("sieves_twice")
    file = entry.value("file")
    if file and not Path(file).is_file():
        raise refusal("no_sieve_table", entry.place("file"), file)
    sizes = (
        sieve_curve(Path(file))
        if file
        else size_distribution(entry.values("size"), entry.values("passing"), entry.place("size"))
    )
    mean = mean_diameter(sizes)
    went = dict.fromkeys(("size", "passing", "file"), "the grains' size distribution")
    return Grains(mean, sizes=sizes, **shared), went, said("sieves", sizes, mean)


def _of_axes(folder, entry, shared):
    flat = entry.values("thickness")
    columns = [entry.values("length"), entry.values("width"), flat or entry.values("width")]
    axes = [fmean(column) for column in columns]
    diameter = fmean(map(math.prod, zip(*columns, strict=True))) ** (1.0 / 3.0)  # of ellipsoids
    try:
        spheres = clump_of_axes(*axes)
    except CalibrationError as error:
        raise CalibrationError(f"{entry.place('length')}: {error}") from None
    shape = f"a clump of {len(spheres)} spheres ({CLUMP})" if spheres else "a sphere"
    went = dict.fromkeys(("length", "width", "thickness"), f"the grains' size and shape: {shape}")
    file = (folder / CLUMP).as_posix()
    grains = Grains(diameter, spheres=spheres, clump_file=file if spheres else "", **shared)
    number = len(entry.values("length"))
    return grains, went, said("axes", number, axes, shape, grains, bool(flat))


def _refuse_without_lead(tested, single):
    if not any(e.method.leads for e in tested):
        raise refusal("no_lead", [e.method.title for e in tested])
    if not single and not any(_leads(e) for e in tested):
        first = next(e for e in tested if e.method.leads)
        raise refusal("single_readings", first.place(first.method.readings[0].key))


def _leads(entry):
    """Return whether a study's chain can be calibrated to a test: its spread is that of several
    readings."""
    read = max((len(entry.values(q.key)) for q in entry.method.readings), default=0)
    return entry.method.leads and max(read, entry.value("n", 1)) > 1


def _leading_first(tested):
    """The entries in the order of their tests."""
    lead = next(filter(_leads, tested), None) or next(e for e in tested if e.method.leads)
    return [lead, *(e for e in tested if e is not lead)]


def _tests(tested, grains):
    """([LaboratoryTest], `Grains`): the leading one first; where grains stick all have the size of
    those in the largest rig. Raises CalibrationError of all that cannot be represented."""
    ordered = _leading_first(tested)
    found = _become(ordered, grains)
    if grains.sticky:
        grains = replace(grains, common_mm=max(_size(t, grains) for t in found))
        found = _become(ordered, grains)
    return [replace(t, run=steady(t, grains)) for t in found], grains


def _become(entries, grains):
    found, faults = [], []
    for entry in entries:
        try:
            found.append(function_of(entry.method.becomes)(entry, grains))
        except CalibrationError as error:
            faults.append(str(error))
    if faults:
        raise CalibrationError("\n".join(faults))
    return found


def _size(test, grains):
    """Mean diameter [mm] of a test's simulated grains."""
    particles = test.run["particles"]
    return particles.get("diameter_mm", grains.diameter_mm) * particles.get("scale_factor", 1.0)


def steady(test: LaboratoryTest, grains: Grains) -> dict:
    """A test's run spec with a time step at which its pressed grains come to rest, where its own or
    that of its experiment is longer.

    Grains that stick are pressed without a load as well: the contact of JKR is that of Hertz under
    four times the pull-off force (Johnson, Kendall, Roberts 1971), here of the strongest bond."""
    experiment = experiments()[test.experiment]
    numerics = dict(test.run.get("numerics", {}))
    if grains.sizes and experiment.poured:
        numerics = {"overlap_limit": ASSUMED.overlap_limit} | numerics
    if not experiment.poured or ("rayleigh_fraction" in numerics and not grains.sticky):
        return test.run | ({"numerics": numerics} if numerics else {})
    diameter = 1e-3 * _size(test, grains)
    radius = 0.5 * diameter * grains.smallest
    material = Material(grains.density_kg_m3, grains.shear_modulus_Pa, 0.25)
    pressure = bed_pressure(test.run["particles"]["count"], diameter, grains.density_kg_m3)
    stress = max((1e3 * v for k, v in test.run["geometry"].items() if k.endswith("stress_kPa")),
                 default=0.0)  # fmt: skip
    pressed = max(pressure, stress)
    if grains.sticky:
        bond = 4.0 * ASSUMED.bonds[1]
        pressed += bond * grains.density_kg_m3 * GRAVITY * math.pi / 6.0 * diameter
    usual = experiment.defaults.get("numerics", {}).get("rayleigh_fraction", ASSUMED.rayleigh)
    usual = min(usual, numerics.get("rayleigh_fraction", usual))
    fraction = steady_fraction(usual, radius, material, pressed, grains.least_restitution)
    return test.run | {"numerics": numerics | {"rayleigh_fraction": fraction}}


def stiff_enough(tested: Sequence[Entry]) -> float:
    """Shear modulus [Pa] at which the largest load dents a grain by `deepest` of its radius.

    By Hertz, with a grain bearing the load on the square about it: overlap/R =
    (3 sqrt(2) p / E*)^(2/3), E* = G / (1 - nu) of two alike grains.
    """
    loads = [e.value(k) for e in tested for k in ("load", "preshear") if e.values(k)]
    largest = 1e3 * max(loads, default=0.0)
    needed = 3.0 * math.sqrt(2.0) * largest / ASSUMED.deepest**1.5 * (1.0 - 0.25)
    return max(ASSUMED.softened_Pa, float(f"{needed:.1e}"))


def uncrushed(test: LaboratoryTest, grains: Grains) -> float:
    """Shear modulus [Pa] at which the largest grain, fallen from the top of where a rig's grains
    are made, squeezes the smallest by `squeezed` of its radius at most; 0 for grains of one size.

    By Hertz: the energy of the fall is that of two contacts of the small grain, each of
    8/15 E* R*^(1/2) d^(5/2), with R* of the two sizes and E* = G / (1 - nu) of two alike grains.
    """
    across = next((test.run["geometry"][k] for k in WIDTHS if k in test.run["geometry"]), None)
    if not grains.sizes or across is None:
        return 0.0
    from dem.experiments.bed import PITCH, shake  # loads the engine

    # the quick profile's grains are larger and as many fewer
    size = 1e-3 * _size(test, grains) * QUICK_WIDER
    large, small = 0.5 * size * grains.longest, 0.5 * size * grains.smallest
    free = 0.5e-3 * across - 1.05 * large
    sites = max(math.pi * free**2 / (PITCH * large) ** 2, 1.0)
    layers = test.run["particles"]["count"] / COARSER["quick"] / sites
    speed = math.sqrt(2.0 * GRAVITY * PITCH * large * layers) + shake(large)
    energy = 0.5 * grains.density_kg_m3 * 4.0 / 3.0 * math.pi * large**3 * speed**2
    shared = math.sqrt(small * large / (small + large))
    stiff = energy / (2.0 * 8.0 / 15.0 * shared * (ASSUMED.squeezed * small) ** 2.5)
    return stiff * (1.0 - 0.25)


def _refuse_two_walls(tests):
    """One wall's friction and restitution stand for all rigs."""
    named = {t.wall: t.rig for t in tests if t.wall}
    if len(named) > 1:
        raise refusal("two_walls", named)


def _refuse_looser_when_tapped(tested):
    """Taps pack a bed, and never loosen it."""
    own = {e.method.name: e for e in tested}
    poured, tapped = (own.get(name) for name in ("bulk-density", "tapped-density"))
    if not poured or not tapped:
        return
    before, after = (fmean(e.values("density")) for e in (poured, tapped))
    if after < before:
        places = tapped.place("density"), poured.place("density")
        raise refusal("looser_when_tapped", places[0], after, before, places[1])


def _refuse_falling_stress(tested):
    """Grains resist shear the more the larger the load on them is."""
    for method in ("shear-cell", "wall-friction"):
        own = [e for e in tested if e.method.name == method and e.values("stress")]
        own.sort(key=lambda e: e.value("load"))
        low, high = (fmean(own[k].values("stress")) for k in (0, -1)) if own else (0.0, 0.0)
        if own and own[-1].value("load") > own[0].value("load") and high <= low:
            loads = own[-1].value("load"), own[0].value("load")
            raise refusal("falling_stress", own[-1].place("stress"), high, loads[0], low, loads[1])


def _measured_ranges(tests):
    """{key: (low, high, source)} of the factors that tests measured: of all tests of one
    together."""
    found: dict = {}
    for test in tests:
        for key, (low, high, source) in test.ranges.items():
            first = found.get(key, (low, high, source))
            told = [first[2], *([source] if source != first[2] else [])]
            found[key] = min(first[0], low), max(first[1], high), "; ".join(told)
    return found


def _ranged(factor, measured, grains):
    """A factor with the range that a bench test measured; a clump rolls by its own shape, so that
    its rolling friction may be nil."""
    if factor.key in measured:
        low, high, source = measured[factor.key]
        return replace(factor, low=low, high=high, description=source)
    if grains.spheres and factor.key == "contacts.particle_particle.rolling_friction":
        note = f"{factor.description}; from 0, as the clump's shape hinders rolling by itself"
        return replace(factor, low=0.0, description=note)
    return factor


def _cohesion(grains, tests):
    """Factors of a sticky material: surface energies at which two simulated grains hold `bonds`
    times their weight."""
    if not grains.sticky:
        return []
    weight = energy_of_weight(grains.common_mm, grains.density_kg_m3)
    bonds = ASSUMED.bonds[0], min(FORMS.get(t.experiment, ASSUMED.bonds[1]) for t in tests)
    low, high = (float(f"{b * weight:.3g}") for b in bonds)
    source = (
        f"wide: two grains of {grains.common_mm:.3g} mm pull by {bonds[0]:g} to {bonds[1]:g} of "
        "their weight" + (", as stickier ones form no heap" if bonds != ASSUMED.bonds else "")
    )
    found = [Factor("H", "grain_grain_surface_energy", COHESION, low, high, source)]
    if any(t.experiment == SLID_ON_A_WALL for t in tests):
        found.append(Factor("J", "grain_wall_surface_energy", WALL_COHESION, low, high, source))
    return found


def _went(entry, tests, tested, shape):
    """Rows of GIVEN: every answer of an entry, the unit that a bare number was taken to have, and
    where it went."""
    went = shape | {
        "density": "run.materials.particle.density_kg_m3",
        "moisture": "the choice of the law of cohesion",
        "material": "the ranges of factors.tsv that no test measured",
    }
    if entry.method.becomes:
        test = tests[_leading_first(tested).index(entry)]
        went = {k: f"rig {test.rig}: {w}" for k, w in test.went.items()}
        went |= dict.fromkeys(("sd", "n"), "its spread, in measured.csv")
    for key, answers in entry.answers.items():
        unit = entry.method.question(key).unit
        for answer in answers:
            bare = unit and not has_unit(answer.text.replace(",", "."))
            yield {"test": entry.method.title, "question": key, "value": answer.text,
                   "unit": unit_of(unit) if bare else "", "from": answer.place,
                   "became": went[key]}  # fmt: skip


def materials() -> list[str]:
    """Names of the materials with published ranges."""
    return sorted({row["material"] for _, row in PUBLISHED.rows} - {""})


def factors_of(material: str | None = None) -> list[Factor]:
    """Factors A to G with their ranges; the description names the source.

    Raises CalibrationError for a material that the table does not have; None takes wide ranges.
    """
    known = materials()
    written = {name.casefold(): name for name in known}
    material = material and written.get(material.casefold(), material)
    if material is not None and material not in known:
        near = difflib.get_close_matches(material, known, n=1)
        raise refusal("no_material", repr(material), near, known)
    own = ((m, line, row) for m in ("", material) for line, row in PUBLISHED.rows)
    found = {row["key"]: (line, row) for m, line, row in own if row["material"] == m}
    return [_factor(code, *at) for code, at in zip("ABCDEFG", found.values(), strict=True)]


def _factor(code, line, row):
    key = row["key"]
    name = key.partition(".")[2].replace("particle", "grain").replace(".", "_")
    low, high = (PUBLISHED.number(line, c, row[c]) for c in ("low", "high"))
    if low == high:
        low, high = round((1 - ASSUMED.band) * low, 4), round((1 + ASSUMED.band) * high, 4)
    return Factor(code, name, key, low, high, row["source"])
