# The atlas: runs of common tests over numbers without a unit, by which `dem estimate` answers
# without a run.
#   snakemake -s workflow/atlas.smk -j2           the runs that are not kept of this engine
#   snakemake -s workflow/atlas.smk -j2 sample    after a change of the engine, whether the kept
#                                                 tables still stand
import sys

from calibration.atlas.rigs import RIGS
from calibration.atlas.runs import SAMPLE, missing

PARTS = {name: missing(name) for name in RIGS}
MADE = "results/atlas/{test}_{part}.csv"
TASK = f"OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 {sys.executable} -m calibration.atlas.runs"


wildcard_constraints:
    test="|".join(RIGS),
    part="[0-9]+",


rule all:
    input:
        [f"results/atlas/{name}.kept" for name, parts in PARTS.items() if parts],


rule part:
    output:
        MADE,
    log:
        "results/atlas/logs/{test}_{part}.log",
    shell:
        "{TASK} make {wildcards.test} {wildcards.part} {output} > {log} 2>&1"


rule keep:
    input:
        lambda w: expand(MADE, test=w.test, part=PARTS[w.test]),
    output:
        touch("results/atlas/{test}.kept"),
    log:
        "results/atlas/logs/{test}.log",
    shell:
        "{TASK} keep {wildcards.test} {input} src/calibration/atlas/kept > {log} 2>&1"


rule sample:
    input:
        expand("results/atlas/sample_{test}.csv", test=RIGS),


rule compare:
    input:
        lambda w: expand(MADE, test=w.test, part=range(SAMPLE)),
    output:
        "results/atlas/sample_{test}.csv",
    log:
        "results/atlas/logs/sample_{test}.log",
    shell:
        "{TASK} compare {wildcards.test} {input} {output} > {log} 2>&1"
