"""Box-Behnken response surface: a quadratic model of the region."""

from calibration.study.factors import read_factors
from calibration.study.stages.stage import (
    PLANNED,
    TARGETS,
    Figure,
    PerTarget,
    Runs,
    Stage,
    Task,
    bench_values,
)

FOLDER = "response_surface"


def runs(config):
    """Number of runs of the design, of as many factors as may go on."""
    from calibration.statistics.composite import surface_design

    rules, going_on = config.response_surface, read_factors(config.factors)
    region = going_on[: config.screening.at_most]
    design = surface_design(region, rules.centre_runs, rules.replicates)
    return len(design) + rules.added_runs


STAGES = (
    Stage(
        name=FOLDER,
        title="Response surface",
        place=3,
        tasks=(
            Task(
                "calibration.chain.response_surface:plan_response_surface",
                "plan the response surface: Box-Behnken design",
                reads=(*PLANNED, "response_surface"),
                inputs={"ascent": "ascent/ascent.json", "fixed": bench_values},
                outputs={"region": f"{FOLDER}/region.json"},
                plans=FOLDER,
                seeds=2,
                expected=runs,
            ),
            Task(
                "calibration.chain.response_surface:response_surface",
                "response surface: quadratic model and its ANOVA",
                reads=TARGETS,
                inputs={
                    "design": f"{FOLDER}/design.csv",
                    "region": f"{FOLDER}/region.json",
                    "runs": Runs(FOLDER),
                },
                outputs={
                    "runs": f"{FOLDER}/runs.csv",
                    "coefficients": f"{FOLDER}/coefficients.csv",
                    "anova": f"{FOLDER}/anova.csv",
                    "diagnostics": f"{FOLDER}/diagnostics.csv",
                    "summary": f"{FOLDER}/response_surface.json",
                    "further": PerTarget(f"{FOLDER}/{{}}.json"),
                    "further_figures": PerTarget(f"{FOLDER}/surfaces_{{}}.svg"),
                    "surfaces": Figure(f"{FOLDER}/surfaces.svg", "surfaces", ("coefficients.csv",)),
                    "predicted": Figure(
                        f"{FOLDER}/predicted_actual.svg", "predicted_actual", ("diagnostics.csv",)
                    ),
                    "residuals": Figure(
                        f"{FOLDER}/residuals.svg", "residuals", ("diagnostics.csv",)
                    ),
                    "perturbation": Figure(
                        f"{FOLDER}/perturbation.svg", "perturbation", ("coefficients.csv",)
                    ),
                },
            ),
        ),
        tables=(
            ("runs", "Design and results"),
            ("anova", "Analysis of variance"),
            ("coefficients", "Coefficients, in coded levels"),
            ("diagnostics", "Residuals and influence"),
        ),
        sentences="calibration.chain.response_surface:sentences",
        pictured=FOLDER,
    ),
)
