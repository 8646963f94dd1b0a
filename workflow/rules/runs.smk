# the runs of all plans; a stage's analysis waits for `runs_of` its plan, see plans.smk

from dem.fingerprint import engine_fingerprint

# named after the engine it stands for: another engine needs another file. (A file that stays and is
# only out of date would not do: Snakemake 9 does not look at what depends on an outdated job
# through `ancient` inputs, not even at missing outputs.)
COMPILED = f"{RUNS}/engine-{engine_fingerprint()}.compiled"

# another engine than this project's has nothing to compile
READY = [] if SETTINGS.own_run.get("engine") else ancient(COMPILED)


# numba compiles the engine once here, so that parallel runs find it compiled
rule compile_engine:
    output:
        touch(COMPILED),
    log:
        f"{RUNS}/compile.log",
    message:
        "compile the engine: about a minute, once after each change of it"
    script:
        "../scripts/compile_engine.py"


# the engine is the only input: a run depends on its own spec and on nothing of the design around it
rule dem_run:
    input:
        compiled=READY,
    output:
        result=f"{RUNS}/{{experiment}}-{{digest}}/result.json",
        state=f"{RUNS}/{{experiment}}-{{digest}}/final.npz",
    log:
        f"{RUNS}/{{experiment}}-{{digest}}/run.log",
    benchmark:
        f"{RUNS}/{{experiment}}-{{digest}}/benchmark.tsv"
    # before the batches: short runs fill the cores that the last heaps of a stage leave
    priority: 1
    resources:
        mem_mb=lambda w: memory_of([spec_of(f"{w.experiment}-{w.digest}")]),
        runtime=60,
    params:
        spec=lambda w: spec_of(f"{w.experiment}-{w.digest}"),
    message:
        "DEM run {wildcards.experiment}-{wildcards.digest}"
    script:
        "../scripts/dem_run.py"


# runs of a second or two share a process; each is kept under its content, so a second study finds
# it
rule run_batch:
    input:
        plan=f"{STUDY}/{{plan}}/plan.json",
        compiled=READY,
    output:
        done=f"{STUDY}/{{plan}}/batches/{{batch}}.json",
    log:
        f"{STUDY}/logs/{{plan}}_batch_{{batch}}.log",
    wildcard_constraints:
        plan="|".join(PLANS),
    resources:
        mem_mb=lambda w: memory_of(plan_of(w.plan).values()),
        runtime=240,
    params:
        batches=lambda w: batches_of(w.plan),
        kept=lambda w: PLANS[w.plan].kept,
    message:
        "{wildcards.plan}: runs, batch {wildcards.batch}"
    script:
        "../scripts/batch.py"
