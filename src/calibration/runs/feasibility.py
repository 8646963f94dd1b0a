"""Before any run: every run spec that a study could expand to is tried, and what the runs will cost
is said.

A level that no run can have would otherwise be met hours later, when its stage is planned.
"""

from functools import partial
from itertools import product
from math import exp, prod

from calibration import engines
from calibration.errors import CalibrationError, ConfigError
from calibration.study import cost
from calibration.study.config import Config, measured, point_spec, states
from calibration.study.config.tests import key_in
from calibration.study.factors import read_factors
from calibration.study.stage import load_stages
from dem.errors import DemError, SpecError
from dem.experiments import experiment_of
from dem.grains.sizes import mean_radius
from dem.spec import RunSpec, input_digests, parse_spec, require_material

RESERVED = ("runs", "reference")
"""Folders below results/ that are no study's."""

MOST_CORNERS = 256


def check_ahead(config: Config) -> None:
    """Raise ConfigError for the first thing that would stop the study later. It may be a name that
    is taken, a level that no run can have, or a number of the material that nothing gives. It may
    be a design or a mesh that cannot be used, an experiment that the study's engine cannot run, or
    a run that needs more memory than there is."""
    if config.name in RESERVED:
        raise ConfigError("is taken", key="name", value=config.name, allowed="another name")
    try:
        measured.is_measured(config) and measured.read_target(config)
    except measured.SingleError:
        raise
    except measured.NotComparableError:
        pass  # a study may have it for its diagnosis alone
    factors = read_factors(config.factors)
    _check_held(config, factors)
    first: RunSpec | None = None
    tried: set[tuple[tuple[str, str], ...]] = set()
    for where, spec in _specs_ahead(config, factors):
        try:
            parsed = parse_spec(spec)
            engines.check(parsed)
        except (SpecError, engines.EngineError) as error:
            raise ConfigError(f"{error}", key=where) from None
        first = first or parsed
        name = where.split(".")[1] if where.startswith("tests.") else config.own
        _check_given(where, parsed)
        _check_flow(where, parsed, partial(key_in, config, name))
        _check_files(where, parsed, partial(key_in, config, name), tried)
    assert first is not None  # every study has runs
    needed, there = cost.memory_mb(first.particles.count), cost.machine_memory_mb()
    if needed > there:
        raise ConfigError(
            f"a run needs about {needed / 1000:.1f} GB of memory; this machine has "
            f"{there / 1000:.1f} GB",
            key=key_in(config, config.own, "particles.count"),
            value=first.particles.count,
            allowed=f"about {(there - cost.BASE_MB) / cost.MB_PER_GRAIN:.0f} grains",
        )


def _check_given(where, spec):
    """Refuse a run spec that leaves a number of the material to the schema."""
    try:
        require_material(spec)
    except SpecError as error:
        why = f"must be given, by `run` or a factor, for the runs of {where}"
        raise ConfigError(why, key=error.key) from None


ARCHES, ARCH_EXPONENT, FREE = 9900.0, 6.9, 4.94
"""Mean number of grains between two arches over an orifice of R grains: ARCHES / (FREE - R) to the
power ARCH_EXPONENT (Zuriguel et al. 2005, Physical Review E 71:051303, arXiv cond-mat/0407761:
spheres of glass, lead and others, whose material does not matter). The abstract was read; the three
numbers are from memory."""
PASS = 0.5  # chance that a funnel runs empty, below which most runs would have no value


def chance_to_empty(across: float, count: float) -> float:
    """Chance that `count` grains leave an orifice that is `across` mean grains wide before an arch
    stands: arches come at random, one in so many grains."""
    if across >= FREE:
        return 1.0
    return exp(-count * (FREE - across) ** ARCH_EXPONENT / ARCHES)


def _check_flow(where, spec, key):
    """Refuse a funnel in which most runs would clog: they have no value, and no stage goes on."""
    if spec.experiment != "heap":
        return
    across = 0.5e-3 * spec.geometry.orifice_diameter_mm / mean_radius(spec)
    chance = chance_to_empty(across, spec.particles.count)
    if chance < PASS:
        raise ConfigError(
            f"the funnel's orifice is {across:.1f} grains wide: by the arches of Zuriguel et al. "
            f"(2005) about {chance:.0%} of the runs of {where} would empty it, the others have no "
            f"value",
            key=key("geometry.orifice_diameter_mm"),
            value=spec.geometry.orifice_diameter_mm,
            allowed=f"{2e3 * FREE * mean_radius(spec):.3g} mm or more, or finer grains than "
            f"{2e3 * mean_radius(spec):.3g} mm (a finer `resolution`), or a lifted cylinder",
        )


def _check_held(config, factors):
    """Refuse a factor that nothing gives a level while it is not varied: the engine's example would
    count, which is of another material."""
    bench = any(test.sweep for test in config.tests.values())
    if config.screening.at_least >= len(factors) and not bench:
        return  # all of them go on
    for factor in factors:
        if not (factor.name in config.fixed or states(config.own_run, factor.key)):
            raise ConfigError(
                "must be given: the factor's level while it is not varied, as for all runs after a "
                "screening that does not send it on",
                key=f"fixed.{factor.name}",
                allowed=f"a level of it: {factor.levels}",
            )


def cost_ahead(config: Config) -> str:
    """A sentence: memory and, for a study of poured grains, time of one run on one core, before any
    has been made."""
    run = point_spec(config.own_run, config.experiment, {}, config.seed)
    count, seconds = parse_spec(run).particles.count, cost.run_seconds(run)
    grains = "1 grain" if count == 1 else f"{count:,} grains"
    time = "" if seconds is None else f" and about {cost.duration(max(1.0, seconds))} of one core"
    return f"a run of {grains} takes about {cost.memory_mb(count):.0f} MB of memory{time}"


def _check_files(where, spec, key, tried):
    """Refuse a mesh that is not there or cannot be used; those `tried` already are not read
    again."""
    digests = input_digests(spec)
    rig = tuple(digests.items())
    if rig in tried:
        return
    tried.add(rig)
    for mesh, digest in digests.items():
        if digest is None:
            value, place = getattr(spec.geometry, mesh), key(f"geometry.{mesh}")
            raise ConfigError("there is no such file", key=place, value=value)
    if digests:
        try:
            experiment_of(spec).prepare(spec)
        except DemError as error:
            raise ConfigError(f"{error}", key=where) from None


def _specs_ahead(config, factors):
    """(what it is, run spec as a mapping) of all runs that the configuration alone decides, of
    those that other experiments make of its tests, and of the corners of the factors' ranges."""
    known = {f.name: f for f in factors}
    fixed = {f.name: f.natural(0.0) for f in factors} | config.fixed

    def at(run, experiment, levels):
        levels = fixed | levels  # a test may name keys that no factor sets
        keyed = {known[n].key if n in known else n: level for n, level in levels.items()}
        return point_spec(run, experiment, keyed, config.seed)

    yield "fixed", at(config.own_run, config.experiment, {})
    for name, test in config.tests.items():
        yield f"tests.{name}", at(config.run_of(name), test.experiment, test.fixed)
    for points in _points_ahead(config, factors):
        named = [c for c in points.design if c in known or "." in c]
        # a design without a named level has one point
        rows = points.design[named].drop_duplicates().to_dict("records") or [{}]
        for levels in rows:
            yield points.key, at(points.run, points.experiment, levels)
    ends = [(f.low, f.high) for f in factors]
    if prod(map(len, ends)) <= MOST_CORNERS:
        for corner in product(*ends):
            levels = dict(zip(known, corner, strict=True))
            yield "a corner of the factors' ranges", at(config.own_run, config.experiment, levels)


def _points_ahead(config, factors):
    """`Points` of the plans of all stages. Raises ConfigError for a design that cannot be made."""
    for plan in (plan for stage in load_stages().values() for plan in stage.plans if plan.ahead):
        try:
            yield from plan.ahead(config, factors)
        except CalibrationError as error:
            raise ConfigError(f"{error}", key=plan.folder) from None
