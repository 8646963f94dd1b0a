# the calibrated parameters as input for other codes. `export` makes no run and is part of `all`;
# the rules behind it search the rolling friction that gives the same angle in the laws of other
# codes: it means another torque there, see docs/other-codes.md


# what other codes read, and pages of those that are filled in by hand
BLOCKS = ["liggghts.in", "lammps.in", "yade.py", "mercurydpm.cpp"]
BY_HAND = ["edem.md", "rocky.md"]
# codes that have a deck, a folder with what one needs to pour the heap
DECKS = ["liggghts", "lammps"]
# what tells how well the chain's optimum is known
SURFACE = {
    "runs": f"{STUDY}/response_surface/runs.csv",
    "region": f"{STUDY}/response_surface/region.json",
    "candidate": f"{STUDY}/candidate/design.csv",
}


rule export:
    input:
        **HANDED_OUT,
        **({} if BY_JOINT else SURFACE),
        answer=f"{STUDY}/answer/answer.json",
        fixed=BENCH_VALUES,
        validation=f"{STUDY}/validation/validation.json",
        validation_runs=f"{STUDY}/validation/runs.csv",
        joint=of_supplements({"joint": "joint.json"}),
        predictions=of_supplements({"joint": "predictions.csv"}),
        factors=FACTORS,
        measurements=measured,
    output:
        parameters=page("calibrated.yaml", "9 Export", "export"),
        blocks=[f"{STUDY}/exports/{file}" for file in BLOCKS],
        by_hand=[f"{STUDY}/exports/{file}" for file in BY_HAND],
        dem_yaml=f"{STUDY}/exports/dem.yaml",
        study_yaml=f"{STUDY}/exports/study.yaml",
        decks=[directory(f"{STUDY}/exports/{code}") for code in DECKS],
    params:
        # it writes the whole configuration
        function="calibration.stages.export:export",
        reads=EVERYTHING,
    message:
        "export: calibrated.yaml and input for other codes"
    script:
        "../scripts/task.py"


checkpoint plan_export_scan:
    input:
        **HANDED_OUT,
        fixed=BENCH_VALUES,
        factors=FACTORS,
    output:
        **planned("export_scan"),
    params:
        function="calibration.stages.export:plan_export_scan",
        reads=[*PLANNING, "target"],
    message:
        "plan the export: rolling friction in the laws of other codes"
    script:
        "../scripts/task.py"


checkpoint plan_export_confirmation:
    input:
        **HANDED_OUT,
        fixed=BENCH_VALUES,
        scan=f"{STUDY}/export_scan/design.csv",
        runs=runs_of("export_scan"),
        factors=FACTORS,
    output:
        **planned("export_confirmation"),
    params:
        function="calibration.stages.export:plan_export_confirmation",
        reads=[*PLANNING, "target"],
    message:
        "plan the export: runs with the rolling friction that was found"
    script:
        "../scripts/task.py"


checkpoint plan_export_correction:
    input:
        **HANDED_OUT,
        fixed=BENCH_VALUES,
        scan=f"{STUDY}/export_scan/design.csv",
        confirmation=f"{STUDY}/export_confirmation/design.csv",
        validation=f"{STUDY}/validation/runs.csv",
        runs=runs_of("export_confirmation"),
        factors=FACTORS,
    output:
        **planned("export_correction"),
    params:
        function="calibration.stages.export:plan_export_correction",
        reads=[*PLANNING, "target", "validation"],
    message:
        "plan the export: runs at a number that is moved to the angle of the study's own grains"
    script:
        "../scripts/task.py"


rule export_rolling:
    input:
        **HANDED_OUT,
        fixed=BENCH_VALUES,
        scan=f"{STUDY}/export_scan/design.csv",
        confirmation=f"{STUDY}/export_confirmation/design.csv",
        correction=f"{STUDY}/export_correction/design.csv",
        validation=f"{STUDY}/validation/runs.csv",
        runs=runs_of("export_correction"),
        factors=FACTORS,
    output:
        rolling=f"{STUDY}/export_correction/rolling.json",
    params:
        function="calibration.stages.export:export_rolling",
        reads=[*PLANNING, "target", "validation"],
    message:
        "export: the same angle with the rolling friction of other codes"
    script:
        "../scripts/task.py"


rule export_converted:
    input:
        **HANDED_OUT,
        answer=f"{STUDY}/answer/answer.json",
        fixed=BENCH_VALUES,
        validation=f"{STUDY}/validation/validation.json",
        validation_runs=f"{STUDY}/validation/runs.csv",
        rolling=f"{STUDY}/export_correction/rolling.json",
        exported=f"{STUDY}/calibrated.yaml",
        factors=FACTORS,
    output:
        blocks=[f"{STUDY}/exports/converted/{file}" for file in BLOCKS],
        decks=[directory(f"{STUDY}/exports/converted/{code}") for code in DECKS],
    params:
        function="calibration.stages.export:export_converted",
        reads=[*PLANNING, *TESTS, "target"],
    message:
        "export: input for other codes, with the rolling friction that gives the angle there"
    script:
        "../scripts/task.py"
