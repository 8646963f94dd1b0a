"""The tests on the laboratory's bench as virtual experiments: tilted plane, drop and direct
shear."""

from calibration.chain.bench_tests import shear, sweep
from calibration.study.stage import Figure, Plan, Stage

RUNS = ("runs", "Runs")

STAGES = (
    Stage(
        name="tilt",
        title="Bench test: tilted plane",
        place=7.1,
        plans=(Plan("tilt", batches=2), Plan("tilt_confirmation", batches=1)),
        figures=(Figure("tilt", ("runs.csv",)),),
        tables=(RUNS,),
        sentences=sweep.sentences,
    ),
    Stage(
        name="drop",
        title="Bench test: drop",
        place=7.2,
        plans=(Plan("drop", batches=1), Plan("drop_confirmation", batches=1)),
        figures=(Figure("drop", ("runs.csv",)),),
        tables=(RUNS,),
        sentences=sweep.sentences,
    ),
    Stage(
        name="shear",
        title="Bench test: direct shear",
        place=7.3,
        plans=(Plan("shear", batches=2),),
        figures=(Figure("yield_locus", ("runs.csv", "shear.json")),),
        tables=(RUNS,),
        sentences=shear.sentences,
    ),
    Stage(
        name="bench",
        title="What the bench tests found",
        place=7.4,
        made_by="bench_parameters",
    ),
)
