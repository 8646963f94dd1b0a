"""Heap and drop enlarged by two rules, without and with cohesion."""

from calibration.study.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="scaling",
        title="Scaling of the particles",
        place=7.5,
        plans=(Plan("scaling", batches=4),),
        figures=(Figure("scaling"),),
        tables=(("scaling", "Scaling"),),
        about="What coarser particles change, and which rule keeps what.",
        unshown=("sd", "left_in_funnel"),
    ),
)
