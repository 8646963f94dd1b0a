"""Screening: which factors matter."""

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


def runs(config):
    """Number of runs of the design."""
    # takes half a second to load, which a run need not wait for once the stage is planned
    from calibration.statistics.screening_design import screening_design

    return len(screening_design(read_factors(config.factors), config.screening))


STAGES = (
    Stage(
        name="screening",
        title="Screening",
        place=1,
        tasks=(
            Task(
                "calibration.chain.screening:plan_screening",
                "plan the screening",
                reads=(*PLANNED, "screening"),
                inputs={
                    "table": lambda study: study.config.screening.design or [],
                    "fixed": bench_values,
                },
                plans="screening",
                seeds=0,
                expected=runs,
            ),
            Task(
                "calibration.chain.screening:screening",
                "screening: effects, ANOVA and the factors that go on",
                reads=("factors", "screening", "ascent", *TARGETS),
                inputs={"design": "screening/design.csv", "runs": Runs("screening")},
                outputs={
                    "effects": "screening/effects.csv",
                    "anova": "screening/anova.csv",
                    "runs": "screening/runs.csv",
                    "summary": "screening/screening.json",
                    "further": PerTarget("screening/effects_{}.csv"),
                    "further_figures": PerTarget("screening/pareto_{}.svg"),
                    "half_normal": Figure(
                        "screening/half_normal.svg", "half_normal", ("effects.csv",)
                    ),
                    "pareto": Figure("screening/pareto.svg", "pareto", ("effects.csv",)),
                },
            ),
        ),
        tables=(
            ("runs", "Design and results"),
            ("effects", "Effects"),
            ("anova", "Analysis of variance"),
        ),
        sentences="calibration.chain.screening:sentences",
        pictured="screening",
    ),
)
