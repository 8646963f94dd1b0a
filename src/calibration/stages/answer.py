"""The answer: every measured row at the parameters that are handed out."""

from calibration.study.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="answer",
        title="Every measured value",
        place=5.05,
        # a measured row that cannot be simulated is told, and stops nothing
        figures=(Figure("pulls", ("tests.csv", "answer.json")),),
        plans=(Plan("answer", batches=2, failures="kept", every_rig=True),),
    ),
)
