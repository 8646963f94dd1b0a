"""kill -9 at random moments: what a campaign comes to in the end is what an undisturbed one comes
to, with nobody to unlock or to clean up."""

import time

import pytest
from kills import (
    checkout,
    disturbed,
    done,
    finish,
    kill,
    left_behind,
    outcome,
    processes_of_jobs,
    start,
    wait_for_orphans,
)

from calibration.runs.verify import faults_of

SEED = 14
# the first four meet a job, snakemake, all at once and a job
SHORT = {"kills": 4, "targets": ["screening"]}
WHOLE = {"kills": 50, "targets": []}


class AlwaysAJob:
    """In place of a generator."""

    def choice(self, _):
        return "job"

    def random(self):
        return 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(SHORT, id="screening"),
        # the whole test profile twice, and the time of the kills: half an hour and more
        pytest.param(WHOLE, id="all", marks=pytest.mark.long),
    ],
)
def test_a_campaign_that_is_killed_ends_as_an_undisturbed_one(tmp_path, case):
    whole, killed = checkout(tmp_path / "whole"), checkout(tmp_path / "killed")
    finish(whole, case["targets"])
    groups = disturbed(killed, case["kills"], SEED, case["targets"])
    assert wait_for_orphans(groups) == []
    assert left_behind(killed) == []
    assert list(faults_of(killed / "results")) == []
    assert done(killed) == done(whole) > 0
    expected, found = outcome(whole), outcome(killed)
    assert sorted(found) == sorted(expected)
    assert [name for name in expected if found[name] != expected[name]] == []


def wait_for_a_job(process):
    """Until snakemake has started a job."""
    while process.poll() is None and not processes_of_jobs(process):
        time.sleep(0.05)


@pytest.mark.slow
def test_the_kill_meets_a_job(tmp_path):
    """A kill that misses would let the test above pass for nothing."""
    folder = checkout(tmp_path)
    process = start(folder, ["audit"])
    wait_for_a_job(process)
    said, ended = kill(process, AlwaysAJob())
    assert not ended
    assert said.startswith("a job")
    assert process.wait() != 0
    assert wait_for_orphans([process.pid]) == []
