"""The pilot of a study on disk: coarse heaps, then narrower ranges in its factor table."""

from pathlib import Path

import yaml

from calibration.study.config import parse_config, read_target
from calibration.study.factors import read_factors
from calibration.study.new.pilot import advice, corners, cost, pilot, shrunk
from calibration.study.new.reach import reach
from calibration.study.new.study import write_factors


def try_study(folder, show=print):
    """Pour a coarse heap at each point of the screening, move the ends of the ranges in to where
    all stand, and say what the study will take."""
    path = Path(folder) / "config.yaml"
    config = parse_config(yaml.safe_load(path.read_text("utf-8")), files=[path])
    show("pilot: the engine is compiled first, which takes a minute once")
    factors = read_factors(config.factors)

    def pour(ranges, points):
        return pilot(config, ranges, points, show)

    def again(ranges, points):
        show(f"{len(points)} do not stand: they are poured again with narrower ranges")
        return pour(ranges, points)

    cut, trials = shrunk(factors, pour(factors, corners(config, factors)), again)
    for old, new in zip(factors, cut, strict=True):
        if old != new:
            show(f"{new.name}: {old.low:g} to {old.high:g} becomes {new.low:g} to {new.high:g}")
    write_factors(config.factors, cut)
    measured = read_target(config).mean()
    for sentence in advice(trials, measured):
        show(sentence)
    for sentence in reach(config, cut, trials, measured, show):
        show(sentence)
    if said := cost(config, trials):
        show(said)
