# the benchmark of the diagnosis: effects hidden in the engine are to be found. It asks nothing of
# the measurements

from diagnosis.declared import SHARDS

HIDDEN = user_file("config/discovery.yaml")


checkpoint discovery_plan:
    input:
        settings=HIDDEN,
        factors=FACTORS,
        again=again("discovery_plan"),
    output:
        design=f"{STUDY}/discovery/design.json",
        plan=f"{STUDY}/discovery/plan.json",
    log:
        f"{STUDY}/logs/discovery_plan.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="diagnosis.benchmark.study:discovery_plan",
        reads=["experiment", "run", "factors"],
        made_from=made_from("discovery_plan"),
    message:
        "benchmark of the diagnosis: plan the emulators' runs"
    script:
        "../scripts/task.py"


rule discovery_emulate:
    input:
        settings=HIDDEN,
        factors=FACTORS,
        design=f"{STUDY}/discovery/design.json",
        plan=f"{STUDY}/discovery/plan.json",
        runs=runs_of("discovery"),
        again=again("discovery_emulate"),
    output:
        emulators=f"{STUDY}/discovery/emulators.npz",
        errors=f"{STUDY}/discovery/emulators.json",
    log:
        f"{STUDY}/logs/discovery_emulate.log",
    benchmark:
        f"{STUDY}/logs/discovery_emulate.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.benchmark.study:discovery_emulate",
        reads=["experiment", "run", "factors"],
        made_from=made_from("discovery_emulate"),
    message:
        "benchmark of the diagnosis: train the emulators"
    script:
        "../scripts/task.py"


# each finished case is kept beside the table, so that an interrupted shard goes on where it was
rule discovery_shard:
    input:
        settings=HIDDEN,
        factors=FACTORS,
        plan=f"{STUDY}/discovery/plan.json",
        emulators=f"{STUDY}/discovery/emulators.npz",
        again=again("discovery_shard"),
    output:
        table=f"{STUDY}/discovery/cases/{{shard}}.csv",
    log:
        f"{STUDY}/logs/discovery_shard_{{shard}}.log",
    benchmark:
        f"{STUDY}/logs/discovery_shard_{{shard}}.tsv"
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        function="diagnosis.benchmark.study:discovery_shard",
        reads=["experiment", "run", "factors"],
        made_from=made_from("discovery_shard"),
    message:
        "benchmark of the diagnosis: cases, part {wildcards.shard}"
    script:
        "../scripts/task.py"


rule discovery_benchmark:
    input:
        settings=HIDDEN,
        factors=FACTORS,
        tables=[f"{STUDY}/discovery/cases/{n}.csv" for n in range(SHARDS)],
        again=again("discovery_benchmark"),
    output:
        cases=f"{STUDY}/discovery/cases.csv",
        confusion=f"{STUDY}/discovery/confusion.csv",
        summary=f"{STUDY}/discovery/summary.csv",
        page=f"{STUDY}/discovery/rates.md",
        figure=f"{STUDY}/discovery/benchmark.svg",
    log:
        f"{STUDY}/logs/discovery_benchmark.log",
    localrule: True
    conda:
        "../envs/calibration.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        function="diagnosis.benchmark.study:discovery_benchmark",
        reads=["experiment", "run", "factors"],
        made_from=made_from("discovery_benchmark"),
    message:
        "benchmark of the diagnosis: confusion matrix, power, false-alarm rates"
    script:
        "../scripts/task.py"
