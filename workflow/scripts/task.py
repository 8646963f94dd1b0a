from calibration.chain.jobs import run_task

run_task(snakemake)
