"""One posterior over all tests of the laboratory: a way to spend runs beside the chain's."""

from calibration.study.stages.stage import Figure, Plan, Stage

STAGES = (
    Stage(
        name="joint",
        title="All tests together",
        place=5.3,
        # the second plan has the runs that the first ones ask for
        plans=(Plan("joint_first"), Plan("joint")),
        figures=(Figure("pairs", ("draws.csv", "joint.json")),),
        tables=(
            ("parameters", "Parameters with their 95 % intervals, by all targets"),
            ("targets", "Each target beside what the others expect of it"),
            ("next", "What each further test is expected to tell"),
            ("predictions", "What is expected of each rig, and from which parameter"),
        ),
        sentences="calibration.chain.joint.words:sentences",
    ),
    Stage(
        name="joint_push_through",
        title="What all tests leave open, in other machines",
        place=5.4,
        plans=(Plan("joint_push_through"),),
        figures=(Figure("push_through", ("metrics.csv", "runs.csv")),),
        tables=(
            ("metrics", "Each metric over the draws"),
            ("shares", "Share of each metric's spread that goes with a parameter"),
        ),
        sentences="calibration.chain.joint.machines:sentences",
    ),
)
