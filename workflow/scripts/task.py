from calibration.jobs import run_task

run_task(snakemake)
