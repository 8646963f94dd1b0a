"""Each study of the reference as a call of its own, then the comparison of ways to calibrate."""

import os
import subprocess
import sys
from pathlib import Path

CALL = [sys.executable, "-m", "snakemake", f"-j{snakemake.threads}", "--configfile"]

with open(snakemake.log[0], "w") as log:
    for study in snakemake.params.studies:
        files = [*snakemake.params.configuration, *study]
        subprocess.run([*CALL, *files], stdout=log, stderr=log, check=True)
    folder = str(Path(snakemake.output.compared).parent)
    compared = [sys.executable, "-m", "benchmarks.ways", folder]
    compared.append(f"--processes={snakemake.threads}")
    single = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    subprocess.run(compared, stdout=log, stderr=log, check=True, env=single)
