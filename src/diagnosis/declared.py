"""The stages of the diagnosis and of its benchmark, as `calibration.stages` describes them."""

from calibration.stages import Figure, Runs, Stage, Task

FOLDER, EXTENSION, SETTINGS = "diagnosis", "diagnosis/extension", "config/diagnosis.yaml"
BENCHMARK, BENCHMARK_SETTINGS = "discovery", "config/discovery.yaml"
SHARDS = 8
READS = ("experiment", "run", "factors", "diagnosis", "measurements")


def settings(study):
    """The diagnosis' own settings."""
    return SETTINGS


def benchmark_settings(study):
    """The benchmark's settings."""
    return BENCHMARK_SETTINGS


def batches(study):
    """Jobs that the emulators' runs are divided into."""
    from diagnosis.settings import read_settings  # loads the catalogue, which only who asks needs

    return read_settings(SETTINGS, study.config.diagnosis).batches


def benchmark_batches(study):
    """The same for the benchmark."""
    from diagnosis.settings import read_settings

    return read_settings(BENCHMARK_SETTINGS).batches


def shards(study):
    """The tables of the benchmark's cases."""
    return [f"{study.folder}/{BENCHMARK}/cases/{n}.csv" for n in range(SHARDS)]


def _figure(name, caption):
    return Figure(f"{FOLDER}/{name}.svg", caption)


def _task(name, message, **more):
    """A task of the diagnosis: each reads the settings."""
    inputs = {"settings": settings} | more.pop("inputs", {})
    function, text = f"diagnosis.stages:{name}", f"diagnosis: {message}"
    return Task(function, text, READS, inputs, **more)


DIAGNOSIS = Stage(
    name="diagnosis",
    title="What the calibrated model gets wrong",
    category="Diagnosis",
    place=6,
    tasks=(
        _task(
            "diagnosis_plan",
            "plan the runs that train the emulators",
            outputs={"design": f"{FOLDER}/design.json"},
            plans=FOLDER,
            batches=batches,
            failures="kept",
        ),
        _task(
            "diagnosis_emulate",
            "train the emulators",
            inputs={
                "design": f"{FOLDER}/design.json",
                "plan": f"{FOLDER}/plan.json",
                "runs": Runs(FOLDER),
            },
            outputs={
                "emulators": f"{FOLDER}/emulators.npz",
                "errors": f"{FOLDER}/emulators.json",
            },
            cheap=False,
        ),
        _task(
            "diagnosis_calibrate",
            "calibrate the base model and show where it fails",
            inputs={"emulators": f"{FOLDER}/emulators.npz"},
            outputs={
                "summary": f"{FOLDER}/calibration.json",
                "table": f"{FOLDER}/residuals.csv",
                "residuals": _figure("residuals", "diagnosis_residuals"),
            },
            cheap=False,
        ),
        _task(
            "diagnosis_identify",
            "name the cause",
            inputs={
                "emulators": f"{FOLDER}/emulators.npz",
                "errors": f"{FOLDER}/emulators.json",
            },
            outputs={
                "design": None,
                "findings": f"{FOLDER}/findings.json",
                "extension": f"{FOLDER}/extension.json",
                "predictions": _figure("predictions", "diagnosis_predictions"),
                "ranking": _figure("ranking", "diagnosis_ranking"),
            },
            plans=EXTENSION,
            batches=batches,
            failures="kept",
            cheap=False,
        ),
        _task(
            "diagnose",
            "the gain of the extended model, and the verdict",
            inputs={
                "calibration": f"{FOLDER}/calibration.json",
                "findings": f"{FOLDER}/findings.json",
                "extension": f"{FOLDER}/extension.json",
                "plan": f"{EXTENSION}/plan.json",
                "runs": Runs(EXTENSION),
            },
            outputs={
                "verdict": f"{FOLDER}/verdict.json",
                "page": Figure(f"{FOLDER}/diagnosis.md", "diagnosis"),
                "gain": _figure("gain", "diagnosis_gain"),
            },
        ),
    ),
)


PLAN = Stage(
    name="diagnosis_power",
    title="What a plan of measurements would show",
    place=6.05,
    tasks=(
        _task(
            "diagnosis_power",
            "how strong a law must be for this plan to show it",
            outputs={"power": f"{FOLDER}/power.json", "page": f"{FOLDER}/power.md"},
            cheap=False,
        ),
    ),
)


def _benchmark_task(name, message, **more):
    """A task of the benchmark, which asks nothing of the measurements: its data are effects hidden
    in the engine."""
    inputs = {"settings": benchmark_settings} | more.pop("inputs", {})
    function = f"diagnosis.benchmark.study:{name}"
    text = f"benchmark of the diagnosis: {message}"
    return Task(function, text, ("experiment", "run", "factors"), inputs, **more)


SUITE = Stage(
    name=BENCHMARK,
    title="Benchmark of the diagnosis",
    place=6.1,
    tasks=(
        _benchmark_task(
            "discovery_plan",
            "plan the emulators' runs",
            outputs={"design": f"{BENCHMARK}/design.json"},
            plans=BENCHMARK,
            batches=benchmark_batches,
            failures="kept",
        ),
        _benchmark_task(
            "discovery_emulate",
            "train the emulators",
            inputs={
                "design": f"{BENCHMARK}/design.json",
                "plan": f"{BENCHMARK}/plan.json",
                "runs": Runs(BENCHMARK),
            },
            outputs={
                "emulators": f"{BENCHMARK}/emulators.npz",
                "errors": f"{BENCHMARK}/emulators.json",
            },
            cheap=False,
        ),
        # each finished case is kept beside the table, so that an interrupted shard goes on where it
        # was
        _benchmark_task(
            "discovery_shard",
            "cases, part {wildcards.shard}",
            inputs={
                "plan": f"{BENCHMARK}/plan.json",
                "emulators": f"{BENCHMARK}/emulators.npz",
            },
            outputs={"table": f"{BENCHMARK}/cases/{{shard}}.csv"},
            cheap=False,
        ),
        _benchmark_task(
            "discovery_benchmark",
            "confusion matrix, power, false-alarm rates",
            inputs={"tables": shards},
            outputs={
                "cases": f"{BENCHMARK}/cases.csv",
                "confusion": f"{BENCHMARK}/confusion.csv",
                "summary": f"{BENCHMARK}/summary.csv",
                "page": f"{BENCHMARK}/rates.md",
                "figure": f"{BENCHMARK}/benchmark.svg",
            },
        ),
    ),
)

STAGES = (DIAGNOSIS, PLAN, SUITE)
