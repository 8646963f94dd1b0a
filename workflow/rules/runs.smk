ENGINE = [os.path.relpath(path) for path in engine_sources()]


# numba compiles the engine once here, so that parallel runs find it compiled
rule compile_engine:
    input:
        ENGINE,
    output:
        touch("results/runs/engine.compiled"),
    log:
        "results/runs/compile.log",
    conda:
        "../envs/calibration.yaml"
    message:
        "compile the engine (once after each change of it)"
    script:
        "../scripts/compile_engine.py"


# the engine's sources are the only input: a run depends on its own spec and on nothing of the design around it
rule dem_run:
    input:
        ENGINE,
        compiled=ancient("results/runs/engine.compiled"),
    output:
        result="results/runs/{experiment}-{digest}/result.json",
        state="results/runs/{experiment}-{digest}/final.npz",
    log:
        "results/runs/{experiment}-{digest}/run.log",
    benchmark:
        "results/runs/{experiment}-{digest}/benchmark.tsv"
    conda:
        "../envs/calibration.yaml"
    params:
        spec=lambda wildcards: spec_of(f"{wildcards.experiment}-{wildcards.digest}"),
    message:
        "DEM run {wildcards.experiment}-{wildcards.digest}"
    script:
        "../scripts/dem_run.py"
