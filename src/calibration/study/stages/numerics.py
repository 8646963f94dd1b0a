"""What resolution, time step, modulus and rolling law cost in the response."""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="numerics",
        title="What the numerical choices cost",
        place=11,
        plans=(Plan("numerics"),),
        figures=(Figure("numerics"),),
        tables=(("numerics", "Numerics"),),
        about="Difference that resolution, time step, stiffness and rolling law make, with its 95 "
        "% interval: "
        "a choice whose interval holds zero, or that stays within the spread from seed to seed, "
        "does not "
        "matter here.",
    ),
)
