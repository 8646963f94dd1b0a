"""The stages of the diagnosis and of its benchmark, as `calibration.study.stages` describes
them."""

from collections.abc import Callable
from dataclasses import dataclass

from calibration.study.stages import Figure, Runs, Stage, Task

SHARDS = 8
EMULATORS = {"emulators": "emulators.npz", "errors": "emulators.json"}
WAVES = 2
"""Times that the emulators of a diagnosis are refined; each is a plan and a training."""

LEFT = {f"left_{k}": f"wave_{k}/left.json" for k in range(1, WAVES + 1)}
"""{name: file} of what is left to refine before each wave."""


@dataclass(frozen=True)
class Part:
    """What the tasks of a stage share: folder of their files, module of their functions, how their
    messages begin, and the sections of the configuration that they read.

    settings : a function of the study that gives the file of the settings, or none
    read : a function of the study that gives the settings
    runs : whether the study needs runs that train emulators, a function of it
    """

    folder: str
    module: str
    words: str
    reads: tuple
    settings: Callable
    read: Callable
    runs: Callable = lambda study: True

    def task(self, name, message, inputs=None, outputs=None, **more):
        """A task of which inputs and outputs are named within the folder."""
        inputs = {"settings": self.settings} | self._at(inputs or {})
        function, text = f"{self.module}:{name}", f"{self.words}: {message}"
        return Task(function, text, self.reads, inputs, self._at(outputs), **more)

    def _at(self, files):
        return {k: f"{self.folder}/{f}" if isinstance(f, str) else f for k, f in files.items()}

    def plan(self, name, message, outputs, inputs=None, folder="", **more):
        """A task that plans runs, of which some may fail."""
        shared = {"plans": f"{self.folder}{folder}", "batches": self.batches, "failures": "kept"}
        return self.task(name, message, inputs, outputs, **shared, **more)

    def train(self, name):
        """The task that trains the emulators with the runs of the plan in the folder."""
        inputs = {"design": "design.json", "plan": "plan.json", "runs": Runs(self.folder)}
        return self.task(name, "train the emulators", inputs, EMULATORS, cheap=False)

    def batches(self, study):
        """Jobs that the emulators' runs are divided into."""
        return self.read(study).batches if self.runs(study) else 1

    def figure(self, name):
        """A figure whose caption bears its name."""
        return Figure(f"{self.folder}/{name}.svg", f"{self.folder}_{name}")


def _own(study):
    from diagnosis.settings import study_settings  # loads the catalogue

    return study_settings(study.config.diagnosis)


def of_wave(wave):
    """{name: file} of the emulators after a wave, 0 the first training."""
    return {name: f"wave_{wave}/{file}" if wave else file for name, file in EMULATORS.items()}


def waves():
    """The tasks that refine the emulators near the posterior mode."""
    designs = {"design": "design.json", "plan": "plan.json"}
    for k in range(1, WAVES + 1):
        yield OWN.plan(
            f"diagnosis_wave_{k}",
            f"plan wave {k} of the emulators' runs, near the posterior mode",
            {"design": f"wave_{k}/design.json", "left": f"wave_{k}/left.json"},
            {"emulators": of_wave(k - 1)["emulators"]},
            folder=f"/wave_{k}",
            cheap=False,
        )
        designs |= {f"design_{k}": f"wave_{k}/design.json", f"plan_{k}": f"wave_{k}/plan.json"}
        yield OWN.task(
            f"diagnosis_refine_{k}",
            f"train the emulators anew with wave {k}",
            of_wave(k - 1) | designs | {"runs": Runs(f"{OWN.folder}/wave_{k}")},
            {f"refined_{name}": file for name, file in of_wave(k).items()},
            cheap=False,
        )


def _emulated(study):
    from diagnosis.measurements import need_emulators

    return need_emulators(study.config.measurements)


def _trained(file):
    """A file that emulators or their waves leave, as an input; none where single contacts are
    integrated, so that none of these stages is run."""
    return lambda study: f"{study.folder}/{OWN.folder}/{file}" if _emulated(study) else []


OWN = Part(
    folder="diagnosis",
    module="diagnosis.stages",
    words="diagnosis",
    reads=("experiment", "run", "factors", "diagnosis", "measurements"),
    settings=lambda study: study.config.diagnosis.get("settings") or [],
    read=_own,
    runs=_emulated,
)

DIAGNOSIS = Stage(
    name="diagnosis",
    title="What the calibrated model gets wrong",
    category="Diagnosis",
    place=6,
    tasks=(
        OWN.plan(
            "diagnosis_plan", "plan the runs that train the emulators", {"design": "design.json"}
        ),
        OWN.train("diagnosis_emulate"),
        *waves(),
        OWN.task(
            "diagnosis_calibrate",
            "calibrate the base model and show where it fails",
            {"emulators": _trained(of_wave(WAVES)["emulators"])},
            {
                "summary": "calibration.json",
                "table": "residuals.csv",
                "residuals": OWN.figure("residuals"),
            },
            cheap=False,
        ),
        OWN.plan(
            "diagnosis_identify",
            "name the cause",
            {
                "design": None,
                "findings": "findings.json",
                "extension": "extension.json",
                "predictions": OWN.figure("predictions"),
                "ranking": OWN.figure("ranking"),
            },
            {name: _trained(file) for name, file in (of_wave(WAVES) | LEFT).items()},
            folder="/extension",
            cheap=False,
        ),
        OWN.task(
            "diagnose",
            "the gain of the extended model, and the verdict",
            {
                "calibration": "calibration.json",
                "findings": "findings.json",
                "extension": "extension.json",
                "plan": "extension/plan.json",
                "runs": Runs("diagnosis/extension"),
            },
            {
                "verdict": "verdict.json",
                "page": Figure("diagnosis/diagnosis.md", "diagnosis"),
                "alone": "diagnosis.html",
                "gain": OWN.figure("gain"),
            },
        ),
    ),
)


PLAN = Stage(
    name="diagnosis_power",
    title="What a plan of measurements would show",
    place=6.05,
    tasks=(
        OWN.task(
            "diagnosis_power",
            "how strong a law must be for this plan to show it",
            {"emulators": _trained(EMULATORS["emulators"])},
            {"power": "power.json", "page": "power.md"},
            cheap=False,
        ),
    ),
)

DISCOVERY = "config/discovery.yaml"


def _hidden(study):
    from diagnosis.settings import read_settings

    return read_settings(DISCOVERY)


# it asks nothing of the measurements: its data are effects hidden in the engine
BENCHMARK = Part(
    folder="discovery",
    module="diagnosis.benchmark.study",
    words="benchmark of the diagnosis",
    reads=("experiment", "run", "factors"),
    settings=lambda study: DISCOVERY,
    read=_hidden,
)


def shards(study):
    """The tables of the benchmark's cases."""
    return [f"{study.folder}/{BENCHMARK.folder}/cases/{n}.csv" for n in range(SHARDS)]


SUITE = Stage(
    name="discovery",
    title="Benchmark of the diagnosis",
    place=6.1,
    tasks=(
        BENCHMARK.plan("discovery_plan", "plan the emulators' runs", {"design": "design.json"}),
        BENCHMARK.train("discovery_emulate"),
        # each finished case is kept beside the table, so that an interrupted shard goes on where it
        # was
        BENCHMARK.task(
            "discovery_shard",
            "cases, part {wildcards.shard}",
            {"plan": "plan.json", "emulators": EMULATORS["emulators"]},
            {"table": "cases/{shard}.csv"},
            cheap=False,
        ),
        BENCHMARK.task(
            "discovery_benchmark",
            "confusion matrix, power, false-alarm rates",
            {"tables": shards},
            {
                "cases": "cases.csv",
                "confusion": "confusion.csv",
                "summary": "summary.csv",
                "page": "rates.md",
                "figure": "benchmark.svg",
            },
        ),
    ),
)

STAGES = (DIAGNOSIS, PLAN, SUITE)
