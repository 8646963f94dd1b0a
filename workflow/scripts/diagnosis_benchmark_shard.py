from calibration import stages
from calibration.discrepancy.benchmark import run_shard
from calibration.discrepancy.settings import read_settings

with stages.logged(snakemake.log[0]):
    config = stages.settings_of(snakemake.params.settings)
    settings = read_settings(snakemake.input.settings)
    shard = int(snakemake.wildcards.shard)
    run_shard(
        config,
        settings,
        snakemake.input,
        shard,
        snakemake.params.shards,
        snakemake.params.kept,
        snakemake.output.table,
    )
