"""A campaign that is killed, or under each fault that a machine has in store: it ends with a
sentence and not with a traceback, and what it comes to is what an undisturbed one comes to, with
nobody to unlock or to clean up."""

import errno
import json
import os
import re
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from signal import SIGKILL

import deployed
import psutil
import pytest
from filelock import FileLock, Timeout

from calibration.runs.verify import faults_of
from dem.kernel_cache import kernel_cache

pytestmark = pytest.mark.slow

LAST_ORPHAN = 60.0
"""Seconds in which what was orphaned has ended after the campaign."""


def outcome(folder):
    """{what: content} of a campaign's results: of each run its numbers and the checksums of its
    files, of the study every table and summary. Times that a run took are no outcome."""
    found = {}
    for path in folder.glob("results/runs/*/result.json"):
        result = json.loads(path.read_text())
        found[path.parent.name] = result["metrics"], result["manifest"]["files"], result["spec"]
    for path in folder.glob("results/*/**/*.*"):
        shown = path.relative_to(folder / "results").as_posix()
        if path.suffix in (".csv", ".json") and not shown.startswith("runs/"):
            found[shown] = path.read_text()
    return found


def left_behind(folder):
    """Files in the folders of runs that only a writer at work may have.

    A process that is killed between its result and the removal of its lock's file leaves that file,
    which is empty and locks nothing: nobody enters a finished run again."""
    names = (".*.partial", ".partial.*", "checkpoint.npz")
    found = [p for name in names for p in folder.glob(f"results/runs/*/{name}")]
    locks = folder.glob("results/runs/*/.lock")
    return found + [p for p in locks if not (p.with_name("result.json").exists() and _free(p))]


def _free(path):
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return False
    lock.release()
    return True


STUDY = re.sub("engine: .*\n", "", deployed.STUDY).format(name="drops", folder=".")


def study(folder):
    """A folder with a study of eight drops of the engine in two batches; no results."""
    deployed.checkout(folder)
    (folder / "factors.tsv").write_text(deployed.FACTORS)
    (folder / "measured.csv").write_text(deployed.MEASURED)
    (folder / "study.yaml").write_text(STUDY)
    return folder


COMMAND = [sys.executable, *"-m snakemake -j2 --configfile study.yaml -- screening".split()]


def campaign(folder, **options):
    """The campaign in a process; what it said, both streams together, as `stdout`."""
    return subprocess.run(
        COMMAND, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        check=False, **options,
    )  # fmt: skip


def started(folder):
    """The campaign under way, as a process that leads a group of its own."""
    with open(folder / "campaign.log", "a") as log:
        return subprocess.Popen(COMMAND, cwd=folder, stdout=log, stderr=log, process_group=0)


def finished(folder):
    done = campaign(folder)
    assert done.returncode == 0, done.stdout
    return outcome(folder)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """What the campaign comes to where nothing happens."""
    found = finished(study(tmp_path_factory.mktemp("undisturbed")))
    assert len([name for name in found if name.startswith("drop-")]) == 8
    return found


def kill_a_job(process):
    """kill -9 of a process below the campaign, if one is there still."""
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(process.pid).children(recursive=True)[-1:]:
            child.kill()


VICTIMS = {
    "snakemake alone, so that its jobs are orphans": subprocess.Popen.kill,
    "a process of a job": kill_a_job,
    "all at once, as when the machine stops": lambda process: os.killpg(process.pid, SIGKILL),
}


@pytest.mark.parametrize("victim", VICTIMS.values(), ids=VICTIMS)
def test_a_campaign_that_is_killed_ends_as_an_undisturbed_one(undisturbed, tmp_path, victim):
    """kill -9 while its runs are made; who starts it again neither unlocks nor forgets anything."""
    process = started(study(tmp_path))
    while not list(tmp_path.glob("results/runs/*/result.json")):
        assert process.poll() is None, (tmp_path / "campaign.log").read_text()
        time.sleep(0.02)
    victim(process)
    process.wait()
    assert finished(tmp_path) == undisturbed
    end = time.monotonic() + LAST_ORPHAN
    while left_behind(tmp_path) and time.monotonic() < end:
        time.sleep(0.5)
    assert left_behind(tmp_path) == []
    assert list(faults_of(tmp_path / "results")) == []


@pytest.fixture
def mounts():
    """Words before a command that let it mount what only it sees."""
    words = ["unshare", "-rm"]
    if shutil.which("unshare") is None or subprocess.run([*words, "true"]).returncode:
        pytest.skip("nobody may mount anything here")
    return words


def test_a_disk_that_is_full(undisturbed, mounts, tmp_path):
    """A file system with room for a third of the results, then for all of them."""
    study(tmp_path)
    (tmp_path / "results").mkdir()
    words = " ".join(f"'{word}'" for word in COMMAND)
    script = f"""
        mount -t tmpfs -o size=80k none results
        {words} > full.log 2>&1 && exit 1
        find results -name '*.json' -size 0 > empty.log
        mount -o remount,size=50m results
        {words} > roomy.log 2>&1 || exit 2
        cp -r results kept
    """
    done = subprocess.run([*mounts, "bash", "-c", script], cwd=tmp_path, check=False)
    said = (tmp_path / "full.log").read_text()
    assert done.returncode == 0, said + (tmp_path / "roomy.log").read_text()
    assert os.strerror(errno.ENOSPC) in said
    assert "Traceback" not in said
    assert (tmp_path / "empty.log").read_text() == ""
    (tmp_path / "results").rmdir()
    (tmp_path / "kept").rename(tmp_path / "results")
    assert outcome(tmp_path) == undisturbed


def test_two_studies_on_one_store(undisturbed, tmp_path):
    """At once, in two folders whose runs are one folder: each run is made once or waited for."""
    folders = [study(tmp_path / name) for name in ("one", "two")]
    (tmp_path / "store").mkdir()
    for folder in folders:
        (folder / "results").mkdir()
        (folder / "results" / "runs").symlink_to(tmp_path / "store")
    both = [started(folder) for folder in folders]
    codes = [process.wait() for process in both]
    said = [(folder / "campaign.log").read_text() for folder in folders]
    assert codes == [0, 0], "\n".join(said)
    for folder in folders:
        assert outcome(folder) == undisturbed


STRANGER = {"user": 54321, "group": 54321, "extra_groups": []}


def reaches_python(user):
    """Whether a user may run this Python at all; below /root nobody else may."""
    try:
        return subprocess.run([sys.executable, "-c", ""], **user).returncode == 0
    except PermissionError:
        return False


def test_a_strange_machine(undisturbed, tmp_path):
    """Locale C, a path with a space and an umlaut, no HOME, and where it can be had a user whom
    nobody knows. Snakemake itself asks for that one's name and settings."""
    folder = study(tmp_path / "other Maschine ü")
    kept = {k: v for k, v in os.environ.items() if k not in ("HOME", "LANG", "XDG_CACHE_HOME")}
    # compiled code is copied: the user's own cache is no stranger's to read
    cache = tmp_path / "numba"
    shutil.copytree(kernel_cache(), cache / kernel_cache().name)
    stranger = {}
    if os.getuid() == 0 and reaches_python(STRANGER):
        stranger = STRANGER
        kept |= {f"XDG_{k}_HOME": str(folder / ".home") for k in ("CONFIG", "DATA", "CACHE")}
        kept["LOGNAME"] = "stranger"
        subprocess.run(["chown", "-R", "54321:54321", folder, cache], check=True)
        for parent in (folder, *folder.parents):
            if parent.stat().st_uid == 0 and not parent.stat().st_mode & 0o005:
                parent.chmod(parent.stat().st_mode | 0o055)
    env = kept | {"LC_ALL": "C", "NUMBA_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    done = campaign(folder, env=env, **stranger)
    assert done.returncode == 0, done.stdout
    assert outcome(folder) == undisturbed
