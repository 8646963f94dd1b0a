"""Optimum: the candidate of the response surface alone, and the optimum with the runs there added.

The surface's optimum is one point of a fit to few runs. Runs are added there and the surface is
solved again, so that what is validated does not rest on how five centre runs happened to fall. How
many it takes, the scatter of the first ones says. With `candidate_runs: 0` none is added, and the
validation's runs, none of which led to the optimum, say alone how far off it is.
"""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="optimise",
        title="Optimum",
        place=4,
        plans=(
            Plan("candidate_first", expected=lambda config: config.optimise.candidate_runs),
            Plan("candidate"),
        ),
        figures=(Figure("contours", ("solution_set.csv", "optimum.json")),),
        tables=(("solution_set", "Points of the solution set"),),
        sentences="calibration.chain.optimum:sentences",
        pictured="candidate",
        also_made_by=lambda config: ("candidate", "plan_candidate_first", "plan_candidate"),
    ),
)
