"""Optimum: the candidate of the response surface alone, and the optimum with the runs there added.

The surface's optimum is one point of a fit to few runs. Runs are added there and the surface is
solved again, so that what is validated does not rest on how five centre runs happened to fall. How
many it takes, the scatter of the first ones says.
"""

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

SOLVED = ("seed", "optimise", "validation", *TARGETS)
SURFACE = {"runs": "response_surface/runs.csv", "region": "response_surface/region.json"}

STAGES = (
    Stage(
        name="optimise",
        title="Optimum",
        place=4,
        tasks=(
            Task(
                "calibration.chain.optimum:candidate",
                "candidate: the optimum of the response surface alone",
                reads=SOLVED,
                inputs=SURFACE,
                outputs={
                    "summary": "candidate/optimum.json",
                    "solutions": "candidate/solution_set.csv",
                    "contours": "candidate/contours.svg",
                },
            ),
            Task(
                "calibration.chain.optimum:plan_candidate_first",
                "plan the first runs at the candidate",
                reads=(*PLANNED, "optimise", "response_surface"),
                inputs={"optimum": "candidate/optimum.json", "fixed": bench_values},
                plans="candidate_first",
                seeds=3,
                expected=lambda config: config.optimise.candidate_runs,
            ),
            # its design has the first runs too, its plan those that they ask for
            Task(
                "calibration.chain.optimum:plan_candidate",
                "plan as many more runs at the candidate as the scatter of the first asks for",
                reads=(*PLANNED, "optimise", "response_surface", "target", "further_targets"),
                inputs={
                    "optimum": "candidate/optimum.json",
                    "fixed": bench_values,
                    "first": "candidate_first/design.csv",
                    "runs": Runs("candidate_first"),
                },
                plans="candidate",
                seeds=3,
            ),
            Task(
                "calibration.chain.optimum:optimise",
                "optimum: all points that give the measured value, and the chosen one",
                reads=SOLVED,
                inputs=SURFACE
                | {"candidate": "candidate/design.csv", "candidate_runs": Runs("candidate")},
                outputs={
                    "summary": "optimise/optimum.json",
                    "solutions": "optimise/solution_set.csv",
                    "contours": Figure(
                        "optimise/contours.svg", "contours", ("solution_set.csv", "optimum.json")
                    ),
                    "front": PerTarget("optimise/front_{}.csv"),
                    "front_figures": PerTarget("optimise/front_{}.svg"),
                },
            ),
        ),
        tables=(("solution_set", "Points of the solution set"),),
        sentences="calibration.chain.optimum:sentences",
        pictured="candidate",
    ),
)
