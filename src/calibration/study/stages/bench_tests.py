"""The tests on the laboratory's bench as virtual experiments: tilted plane, drop and direct
shear."""

from calibration.study.stages.stage import PLANNED, Figure, Runs, Stage, Task


def sweep(test, title, batches, place):
    """A sweep of one parameter, its fit, and runs at the inverse for the measured value."""
    module, confirmation = "calibration.chain.bench_tests.sweep", f"{test}_confirmation"
    needs = (f"bench.{test}",)
    reads, compared = (*PLANNED, "bench"), (*PLANNED, "bench", "measurements")
    return Stage(
        name=test,
        title=f"Bench test: {title}",
        category="Bench tests",
        place=place,
        tasks=(
            Task(
                f"{module}:plan_{test}",
                f"plan the {test} test: sweep",
                reads=reads,
                needs=needs,
                plans=test,
                batches=batches,
            ),
            Task(
                f"{module}:plan_{confirmation}",
                f"plan the {test} test: runs at the inverse of the fit",
                reads=compared,
                needs=needs,
                inputs={"sweep": f"{test}/design.csv", "runs": Runs(test)},
                plans=confirmation,
                batches=1,
            ),
            Task(
                f"{module}:{test}",
                f"{test} test: fit, inverse and confirmation",
                reads=compared,
                needs=needs,
                inputs={
                    "sweep": f"{test}/design.csv",
                    "confirmation": f"{confirmation}/design.csv",
                    "runs": Runs(confirmation),
                },
                outputs={
                    "summary": f"{test}/{test}.json",
                    "runs": f"{test}/runs.csv",
                    "figure": Figure(f"{test}/{test}.svg", test, ("runs.csv",)),
                },
            ),
        ),
        tables=(("runs", "Runs"),),
        sentences=f"{module}:sentences",
    )


STAGES = (
    sweep("tilt", "tilted plane", batches=2, place=7.1),
    sweep("drop", "drop", batches=1, place=7.2),
    Stage(
        name="shear",
        title="Bench test: direct shear",
        category="Bench tests",
        place=7.3,
        tasks=(
            Task(
                "calibration.chain.bench_tests.shear:plan_shear",
                "plan the shear test",
                reads=(*PLANNED, "bench"),
                needs=("bench.shear",),
                plans="shear",
                batches=2,
            ),
            Task(
                "calibration.chain.bench_tests.shear:shear",
                "shear test: yield locus",
                reads=("factors", "fixed", "bench", "run", "measurements"),
                needs=("bench.shear",),
                inputs={"design": "shear/design.csv", "runs": Runs("shear")},
                outputs={
                    "summary": "shear/shear.json",
                    "runs": "shear/runs.csv",
                    "figure": Figure("shear/yield_locus.svg", "shear", ("runs.csv", "shear.json")),
                },
            ),
        ),
        tables=(("runs", "Runs"),),
        sentences="calibration.chain.bench_tests.shear:sentences",
    ),
    # in the form of the configuration's `fixed`; the heaps take it with `fixed_from: bench`
    Stage(
        name="bench",
        title="What the bench tests found",
        place=7.4,
        tasks=(
            Task(
                "calibration.chain.bench_tests.sweep:bench_parameters",
                "collect what the bench tests found",
                inputs={test: f"{test}/{test}.json" for test in ("tilt", "drop", "shear")},
                outputs={"fixed": "bench/fixed.json"},
            ),
        ),
    ),
)
