"""Each study of the reference as a call of its own."""

import subprocess
import sys

CALL = [sys.executable, "-m", "snakemake", f"-j{snakemake.threads}", "--configfile"]

with open(snakemake.log[0], "w") as log:
    for study in snakemake.params.studies:
        called = [*CALL, *snakemake.params.configuration, *study]
        subprocess.run(called, stdout=log, stderr=log, check=True)
