from calibration.jobs import logged, settings_of
from diagnosis.benchmark.study import run_shard
from diagnosis.settings import read_settings

with logged(snakemake.log[0]):
    config = settings_of(snakemake.config)
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
