# the calibrated parameters as input for other codes. `export` makes no run and is part of `all`;
# the rules behind it search the rolling friction that gives the same angle in the laws of other
# codes: it means another torque there, see docs/other-codes.md


# codes that have a deck, a folder with what one needs to pour the heap
DECKS = ["liggghts", "lammps"]


rule export:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        validation=f"{STUDY}/validation/validation.json",
        validation_runs=f"{STUDY}/validation/runs.csv",
        runs=f"{STUDY}/response_surface/runs.csv",
        region=f"{STUDY}/response_surface/region.json",
        candidate=f"{STUDY}/candidate/design.csv",
        factors=FACTORS,
        measurements=measured,
        again=again("export"),
    output:
        parameters=report(
            f"{STUDY}/calibrated.yaml",
            caption="../report/export.rst",
            category="9 Export",
        ),
        liggghts_in=f"{STUDY}/exports/liggghts.in",
        lammps_in=f"{STUDY}/exports/lammps.in",
        yade_py=f"{STUDY}/exports/yade.py",
        mercurydpm_cpp=f"{STUDY}/exports/mercurydpm.cpp",
        edem_md=f"{STUDY}/exports/edem.md",
        rocky_md=f"{STUDY}/exports/rocky.md",
        dem_yaml=f"{STUDY}/exports/dem.yaml",
        study_yaml=f"{STUDY}/exports/study.yaml",
        decks=[directory(f"{STUDY}/exports/{code}") for code in DECKS],
    log:
        f"{STUDY}/logs/export.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        # it writes the whole configuration
        function="calibration.telling.export.stage:export",
        reads=list(Config.model_fields),
        made_from=made_from("export"),
    message:
        "export: calibrated.yaml and input for other codes"
    script:
        "../scripts/task.py"


rule joint_export:
    input:
        factors=FACTORS,
        fixed=BENCH_VALUES,
        summary=f"{STUDY}/joint/joint.json",
        draws=f"{STUDY}/joint/draws.csv",
        predictions=f"{STUDY}/joint/predictions.csv",
        again=again("joint_export"),
    output:
        parameters=report(
            f"{STUDY}/joint_export/calibrated.yaml",
            caption="../report/joint_export.rst",
            category="9 Export",
        ),
        liggghts_in=f"{STUDY}/joint_export/liggghts.in",
        lammps_in=f"{STUDY}/joint_export/lammps.in",
        yade_py=f"{STUDY}/joint_export/yade.py",
        mercurydpm_cpp=f"{STUDY}/joint_export/mercurydpm.cpp",
        edem_md=f"{STUDY}/joint_export/edem.md",
        rocky_md=f"{STUDY}/joint_export/rocky.md",
        dem_yaml=f"{STUDY}/joint_export/dem.yaml",
    log:
        f"{STUDY}/logs/joint_export.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.joint:joint_export",
        reads=[
            "name",
            "seed",
            "experiment",
            "run",
            "factors",
            "fixed",
            "fixed_from",
            "joint",
            "published",
        ],
        made_from=made_from("joint_export"),
    message:
        "joint export: a set of parameters by all tests together, as input for other codes"
    script:
        "../scripts/task.py"


checkpoint plan_export_scan:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        factors=FACTORS,
        again=again("plan_export_scan"),
    output:
        design=f"{STUDY}/export_scan/design.csv",
        plan=f"{STUDY}/export_scan/plan.json",
    log:
        f"{STUDY}/logs/plan_export_scan.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.stage:plan_export_scan",
        reads=["seed", "experiment", "fixed", "run", "factors", "target"],
        made_from=made_from("plan_export_scan"),
    message:
        "plan the export: rolling friction in the laws of other codes"
    script:
        "../scripts/task.py"


checkpoint plan_export_confirmation:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        scan=f"{STUDY}/export_scan/design.csv",
        runs=runs_of("export_scan"),
        factors=FACTORS,
        again=again("plan_export_confirmation"),
    output:
        design=f"{STUDY}/export_confirmation/design.csv",
        plan=f"{STUDY}/export_confirmation/plan.json",
    log:
        f"{STUDY}/logs/plan_export_confirmation.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.stage:plan_export_confirmation",
        reads=["seed", "experiment", "fixed", "run", "factors", "target"],
        made_from=made_from("plan_export_confirmation"),
    message:
        "plan the export: runs with the rolling friction that was found"
    script:
        "../scripts/task.py"


checkpoint plan_export_correction:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        scan=f"{STUDY}/export_scan/design.csv",
        confirmation=f"{STUDY}/export_confirmation/design.csv",
        validation=f"{STUDY}/validation/runs.csv",
        runs=runs_of("export_confirmation"),
        factors=FACTORS,
        again=again("plan_export_correction"),
    output:
        design=f"{STUDY}/export_correction/design.csv",
        plan=f"{STUDY}/export_correction/plan.json",
    log:
        f"{STUDY}/logs/plan_export_correction.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.stage:plan_export_correction",
        reads=[
            "seed",
            "experiment",
            "fixed",
            "run",
            "factors",
            "target",
            "validation",
        ],
        made_from=made_from("plan_export_correction"),
    message:
        "plan the export: runs at a number that is moved to the angle of the study's own grains"
    script:
        "../scripts/task.py"


rule export_rolling:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        scan=f"{STUDY}/export_scan/design.csv",
        confirmation=f"{STUDY}/export_confirmation/design.csv",
        correction=f"{STUDY}/export_correction/design.csv",
        validation=f"{STUDY}/validation/runs.csv",
        runs=runs_of("export_correction"),
        factors=FACTORS,
        again=again("export_rolling"),
    output:
        rolling=f"{STUDY}/export_correction/rolling.json",
    log:
        f"{STUDY}/logs/export_rolling.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.stage:export_rolling",
        reads=[
            "seed",
            "experiment",
            "fixed",
            "run",
            "factors",
            "target",
            "validation",
        ],
        made_from=made_from("export_rolling"),
    message:
        "export: the same angle with the rolling friction of other codes"
    script:
        "../scripts/task.py"


rule export_converted:
    input:
        fixed=BENCH_VALUES,
        optimum=f"{STUDY}/optimise/optimum.json",
        validation=f"{STUDY}/validation/validation.json",
        validation_runs=f"{STUDY}/validation/runs.csv",
        rolling=f"{STUDY}/export_correction/rolling.json",
        exported=f"{STUDY}/calibrated.yaml",
        factors=FACTORS,
        again=again("export_converted"),
    output:
        liggghts_in=f"{STUDY}/exports/converted/liggghts.in",
        lammps_in=f"{STUDY}/exports/converted/lammps.in",
        yade_py=f"{STUDY}/exports/converted/yade.py",
        mercurydpm_cpp=f"{STUDY}/exports/converted/mercurydpm.cpp",
        decks=[directory(f"{STUDY}/exports/converted/{code}") for code in DECKS],
    log:
        f"{STUDY}/logs/export_converted.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="calibration.telling.export.stage:export_converted",
        reads=[
            "seed",
            "experiment",
            "fixed",
            "run",
            "factors",
            "target",
            "targets",
            "rigs",
        ],
        made_from=made_from("export_converted"),
    message:
        "export: input for other codes, with the rolling friction that gives the angle there"
    script:
        "../scripts/task.py"
