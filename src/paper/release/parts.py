"""The parts of a release's data, in the order in which they are made: their commands, and what of
their results is kept."""

import sys
from dataclasses import dataclass

PYTHON, CORES = sys.executable, "{cores}"
SNAKEMAKE = (PYTHON, "-m", "snakemake", f"-j{CORES}")
STUDY = (*SNAKEMAKE, "--configfile", "config/config.yaml")
# with what the paper claims beyond its calibration
CLAIMED = (*STUDY, "config/claims.yaml")
OUTCOME = (PYTHON, "-m", "calibration.telling.kept_results")
BALL = "data/literature/table_tennis_ball.yaml"
ANGLE = "angle_of_repose_deg"
TRIED = {"crossed": "rate and speed of the pour", "rig-causes": "the rest of the rig"}
"""What follows the name of a study in those that try causes with several seeds at a row, and what
these causes are."""


@dataclass(frozen=True)
class Part:
    """Data of a release that are made together.

    name : in the record, and on the command line
    about : for the list
    commands : run one after the other in the root of the project; {cores} is their number
    keep : (study, ...) whose results are copied to results/reference before the pages are written
    copies : (folder, folder of results/reference) whose files, no folders, are copied
    """

    name: str
    about: str
    commands: tuple
    keep: tuple = ()
    copies: tuple = ()


def _seed(seed):
    name, stages = f"salt-{seed}", ("screening", "response_surface")[: 2 if seed == 2 else 1]
    targets = (f"results/{name}/{stage}/{stage}.json" for stage in stages)
    return (*CLAIMED, "--config", f"seed={seed}", f"name={name}", "--", *targets)


def _joint(name):
    files = (f"examples/{name}/config.yaml", f"examples/{name}/joint.yaml")
    stages = ("push_through", "joint_push_through")
    return (*SNAKEMAKE, "--configfile", *files, "--config", "resolution=quick", "--", *stages)


def _joint_tables(name):
    stages = ("joint", "joint_push_through", "push_through", "posterior")
    return tuple((f"results/{name}-quick/{stage}", f"{name}/{stage}") for stage in stages)


RATES = (PYTHON, "-m", "benchmarks.rates")
TRIALS = ("single_grains", "strangers", "bulk_tables")
PARTS = (
    Part(
        "verification",
        "the engine against closed forms, publications and bulk laws",
        ((PYTHON, "-m", "pytest", "tests/verification", "-n", CORES, "-m", "", "--record"),),
    ),
    Part(
        "salt",
        "the paper's study with all of its supplements, the same in the rig as printed, and what "
        "differs between the simulations",
        (
            CLAIMED,
            (*CLAIMED, "config/rigs/printed.yaml"),
            (*CLAIMED, "--", "reproduction", "disagreement"),
            (PYTHON, "-m", "paper.reference", "results/salt"),
        ),
        keep=("salt-printed",),
    ),
    Part(
        "opened rig",
        "the paper's study out of a funnel that is filled, then opened",
        ((*STUDY, "config/rigs/opened.yaml"),),
        keep=("salt-opened",),
    ),
    Part(
        "rigs",
        "which rig is well-posed: rates and speeds of the pour at three points",
        ((PYTHON, "-m", "paper.rigs", "results/rigs"),),
        copies=(("results/rigs", "rigs"),),
    ),
    Part(
        "screening at other seeds",
        "the paper's screening at three more seeds, and its region at one",
        tuple(_seed(seed) for seed in (2, 3, 4)),
        keep=("salt-2", "salt-3", "salt-4"),
    ),
    Part(
        "beside the paper",
        "the paper's tables once more, beside the screenings at other seeds too",
        ((*CLAIMED, "--", "reproduction"), (PYTHON, "-m", "paper.reference", "results/salt")),
    ),
    Part(
        "numerics",
        "what the default numerics cost in degrees",
        ((*CLAIMED, "--", "numerics"),),
        keep=("salt",),
    ),
    Part(
        "soybean",
        "a second material",
        (
            (*SNAKEMAKE, "--configfile", "examples/soybean/config.yaml"),
            (*OUTCOME, "results/soybean", "results/reference/soybean", "examples/soybean/README.md",
             ANGLE),
        ),
    ),
    Part(
        "joint",
        "materials by all their tests together, beside what one target gives",
        (_joint("maize"),),
        copies=_joint_tables("maize"),
    ),
    Part(
        "salt joint",
        "the salt by all its tests together",
        ((*STUDY, "config/joint.yaml", "--", "joint"),),
        copies=(("results/salt/joint", "salt/joint"),),
    ),
    Part(
        "diagnosis",
        "the paper's own measurements, and a table-tennis ball",
        (
            (*SNAKEMAKE, "--profile", "profiles/quick", "diagnose"),
            (*SNAKEMAKE, "--configfile", BALL, "--", "diagnose"),
        ),
        copies=(
            ("results/salt-quick/diagnosis", "salt-diagnosis"),
            ("results/table-tennis-ball/diagnosis", "table-tennis-ball"),
        ),
    ),
    Part(
        "diagnosis benchmark",
        "hidden effects and nulls: single grains of the engine, and tables of strangers",
        (
            *((*RATES, trial, what) for trial in TRIALS for what in ("run", "table")),
        ),
    ),
    Part(
        "emulated benchmark",
        "laws hidden in heaps, silos, shear cells and densities of engines, and nulls",
        (
            (*RATES, "engine_tables", "run"),
            (*RATES, "engine_tables", "table"),
        ),
    ),
    Part(
        "crossed causes",
        "what differs between the simulations: the pour and the rig, three seeds at a row",
        tuple(
            (*SNAKEMAKE, "--config", f"name=salt-{causes}", "--", "disagreement")
            for causes in TRIED
        ),
        copies=tuple(
            (f"results/salt-{causes}/disagreement", f"salt-{causes}/disagreement")
            for causes in TRIED
        ),
    ),
    Part(
        "comparison",
        "ways to calibrate, tried on responses in closed form",
        (
            (PYTHON, "-m", "benchmarks.ways", "results/comparison",
             f"--processes={CORES}"),
        ),
        copies=(("results/comparison", "comparison"),),
    ),
    Part(
        "decks",
        "decks as they are written, in LIGGGHTS, LAMMPS and YADE, which must be installed",
        ((PYTHON, "-m", "benchmarks.decks"),),
    ),
    Part(
        "other codes",
        "one study in LIGGGHTS, LAMMPS and this engine; needs both programs",
        ((PYTHON, "-m", "benchmarks.code_studies", CORES),),
    ),
)  # fmt: skip
