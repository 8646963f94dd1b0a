# every measured row simulated at the parameters that the study hands out, and answer.json, which all
# that says what the study found is made from

BENCH = {} if BY_JOINT else {test: f"{test}.json" for test in ("tilt", "drop", "shear")}
MACHINES = {m: f"{m}.json" for m in ("push_through", "joint_push_through")}
# plans whose runs the answer counts; those of the diagnosis are its own
COUNTED = [
    plan.folder
    for name in OWN
    for plan in STAGES[name].plans
    if name not in ("answer", "diagnosis")
]


checkpoint plan_answer:
    input:
        **HANDED_OUT,
        bench=of_supplements(BENCH),
        factors=FACTORS,
        fixed=BENCH_VALUES,
        measurements=measured,
    output:
        **planned("answer"),
    params:
        function="calibration.stages.answer:plan_answer",
        reads=[*PLANNING, *RESPONSES, "supplements", "validation"],
        seeds=9,
    message:
        "plan the answer: each measured row at the parameters handed out"
    script:
        "../scripts/task.py"


rule answer:
    input:
        **HANDED_OUT,
        **planned("answer"),
        bench=of_supplements(BENCH),
        runs=runs_of("answer"),
        validated=f"{STUDY}/validation/runs.csv",
        validation=f"{STUDY}/validation/validation.json",
        posterior=of_supplements({"posterior": "posterior.json"}),
        joint=of_supplements({"joint": "joint.json"}),
        machines=of_supplements(MACHINES),
        verdict=of_supplements({"diagnosis": "verdict.json"}),
        plans=[f"{STUDY}/{folder}/plan.json" for folder in COUNTED],
        factors=FACTORS,
        fixed=BENCH_VALUES,
        measurements=measured,
    output:
        answer=f"{STUDY}/answer/answer.json",
        tests=f"{STUDY}/answer/tests.csv",
        figure=page("answer/pulls.svg", "0 The whole study", "answer"),
    params:
        # it names each value's source, which any section may be
        function="calibration.stages.answer:answer",
        reads=EVERYTHING,
    message:
        "answer: what the study found, beside everything that was measured"
    script:
        "../scripts/task.py"
