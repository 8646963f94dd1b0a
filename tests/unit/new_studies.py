"""Studies that tests begin by `dem new`, of three laboratories; runs in place of the engine's."""

from pathlib import Path

import yaml

from calibration.interface.commands import main
from calibration.study.config.joint import joint_targets, read_joint_target
from calibration.study.config.parse import parse_resolved
from dem.experiments import experiments

WHEAT = (
    "--lifted-cylinder 26.1,27.4,28.0,26.8,27.9 --bulk-density 765kg/m3 sd=6kg/m3 n=5 "
    "--drop 78mm sd=4mm n=10 height=300mm wall=steel --tilted-plane 21 sd=1 n=5 wall=steel "
    "--axes 6.2x3.3x2.9mm --density 1.32g/cm3"
).split()
POWDER = (
    "--lifted-cylinder 51 52 53 cylinder=50mm depth=60mm speed=20mm/s --moisture moist "
    "--bulk-density 0.9g/cm3 0.91g/cm3 --density 2.7g/cm3 --grain 0.05mm "
    "--shear-cell 1.9kPa load=2kPa --shear-cell 3.4kPa load=4kPa "
    "--shear-cell 4.8kPa load=6kPa --shear-cell 6.4kPa load=8kPa"
).split()
SIEVE = "Siebweite [mm];Durchgang [%]\n16;100\n8;60\n4;20\n2;0\n"
GRAVEL = (
    "--funnel 36 37 38 orifice=120mm plate=400mm height=250mm --density 2650kg/m3 "
    "--sieve sieve.csv --bulk-density 1500kg/m3 1520kg/m3"
).split()


def begun(name, options):
    """The configuration of a study that is begun without a pilot in the working directory."""
    if "sieve.csv" in options:
        Path("sieve.csv").write_text(SIEVE)
    assert main(["new", name, *options, "--no-pilot"]) == 0
    return read(name)


def read(name, **more):
    """The configuration of a study that was begun, with further keys."""
    path = Path(name, "config.yaml")
    return parse_resolved(yaml.safe_load(path.read_text("utf-8")) | more, [path])


def measured(config):
    """{(rig, metric): what was measured} of the joint targets of a study."""
    return {(t.test, t.metric): read_joint_target(config, t) for t in joint_targets(config)}


def piloted(monkeypatch, metrics_of):
    """Runs of `metrics_of(spec)` in place of the engine's, and ranges that the atlas leaves;
    returns the specs that were run, of which none is before the engine is compiled."""
    made = []

    def run(spec, out):
        made.append(spec)
        targets = dict.fromkeys(experiments()[spec.experiment].targets, 1.0)
        return {"metrics": targets | {"in_funnel": 0} | metrics_of(spec)}

    ranges = "calibration.interface.estimate.ranges_by_atlas"
    monkeypatch.setattr(ranges, lambda config, factors: (factors, [], []))
    monkeypatch.setattr("dem.precompile.compile_engine", made.clear)
    monkeypatch.setattr("dem.run.run", run)
    return made
