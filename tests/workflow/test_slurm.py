"""The same campaign by the jobs of a cluster and by this machine's own processes: equal to the bit.
The cluster is Debian's SLURM on this machine, without accounts."""

import sys

import pytest
import slurm
from deployed import done
from test_kills import finished, outcome, study

pytest.importorskip("snakemake_executor_plugin_slurm")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(slurm.missing()), reason=f"SLURM: no {', '.join(slurm.missing())}"),
]

ON_CLUSTER = (sys.executable, "-m", "snakemake", "--workflow-profile", "profiles/slurm")


@pytest.fixture(scope="module")
def environment():
    with slurm.cluster() as environment:
        yield environment


def test_a_screening_on_a_cluster_is_the_local_one_to_the_bit(environment, tmp_path):
    """Eight drops of this project's engine, in two jobs, after one that compiles."""
    cluster = study(tmp_path / "cluster")
    options = ("--configfile", "study.yaml", "--", "screening")
    said = done(*ON_CLUSTER, *options, cwd=cluster, env=environment)
    assert outcome(cluster) == finished(study(tmp_path / "local"))
    assert said.count("SLURM jobid") == 3
