"""With this folder on PYTHONPATH, each job of snakemake writes what it touched and did not declare
into the folder that OPENED names."""

import atexit
import os
import sys

from watch import leave, watching

if "OPENED" in os.environ:
    watch = watching()
    seen = watch.__enter__()

    @atexit.register
    def _leave():
        job = getattr(sys.modules["__main__"], "snakemake", None)
        if job is not None:
            leave(job, set(seen), os.environ["OPENED"])
