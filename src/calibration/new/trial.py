"""The pilot of a study on disk: coarse heaps, then narrower ranges in its factor table."""

from pathlib import Path

import yaml

from calibration.config import parse_config
from calibration.factors import read_factors
from calibration.new.pilot import advice, cost, pilot, shrunk
from calibration.new.study import write_factors


def try_study(folder, show=print):
    """Pour the pilot's heaps, cut the ranges to where they stand, and say what the study will
    take."""
    path = Path(folder) / "config.yaml"
    config = parse_config(yaml.safe_load(path.read_text("utf-8")), files=[path])
    show("pilot: the engine is compiled first, which takes a minute once")
    trials = pilot(config, show=show)
    factors = read_factors(config.factors)
    cut = shrunk(factors, trials)
    for old, new in zip(factors, cut, strict=True):
        if old != new:
            show(f"{new.name}: {old.low:g} to {old.high:g} becomes {new.low:g} to {new.high:g}")
    write_factors(config.factors, cut)
    for sentence in (*advice(trials), cost(config, trials)):
        if sentence:
            show(sentence)
