"""A campaign that is killed at random moments, or under each fault that a machine has in store: it
ends with a sentence and not with a traceback, and what it comes to is what an undisturbed one comes
to, with nobody to unlock or to clean up."""

import contextlib
import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import psutil
import pytest
from deployed import FACTORS, MEASURED, checkout
from filelock import FileLock, Timeout

from calibration.runs.verify import faults_of
from dem.kernel_cache import kernel_cache
from facts import tells

pytestmark = pytest.mark.slow

SEED = 14
"""Of the moments and victims. What then happens depends on the machine's speed too, so that a seed
repeats the kills and not the outcome."""
KILLS = 4
MOMENTS = 2.0, 40.0
"""Seconds between two kills: from before snakemake has planned anything to some runs later."""
VICTIMS = ("snakemake", "job", "job", "all")
"""snakemake alone, so that its jobs are orphans; one process of one job; all at once, as when the
machine stops."""
LAST_ORPHAN = 120.0
"""Seconds in which what was orphaned has ended after the campaign."""


def start(folder):
    """The test profile's screening as a process that leads a group of its own; it is told neither
    to unlock nor to forget anything."""
    command = [sys.executable, "-m", "snakemake", "-j2", "--profile", "profiles/test", "screening"]
    with open(folder / "campaign.log", "a") as log:
        return subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, start_new_session=True)


def kill(process, victim, draw):
    """kill -9 of a victim; returns (what it was, whether the campaign itself was met)."""
    while victim == "job" and process.poll() is None:
        if jobs := processes_of_jobs(process):
            with contextlib.suppress(psutil.NoSuchProcess):
                jobs[int(draw * len(jobs))].kill()
                return "job", False
        time.sleep(0.05)
    if victim == "all":
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()
    return victim, True


def processes_of_jobs(process):
    """Living processes below the campaign that are a snakemake of their own: those that a job
    cannot do without.

    Campaign and job also ask other programs, such as git, what machine this is, and go on without
    their answer: such a child still has its parent's command line until it has become the other
    program. And a process that has ended can still be in the list."""
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        with contextlib.suppress(psutil.Error):
            command = child.cmdline()
            ended = child.status() == psutil.STATUS_ZOMBIE
            a_copy = command == child.parent().cmdline()
            if "snakemake" in " ".join(command) and not ended and not a_copy:
                found.append(child)
    return found


def disturbed(folder):
    """Kill the screening, then let it end. Returns the groups of processes that it was made in, and
    the victims."""
    rng, victims, groups = random.Random(SEED), [], []
    while len(victims) < KILLS:
        process = start(folder)
        groups.append(process.pid)
        over, before = False, len(victims)
        while not over and len(victims) < KILLS:
            try:
                process.wait(rng.uniform(*MOMENTS))
                over = True  # finished, or stopped as one of its jobs was killed
            except subprocess.TimeoutExpired:
                victim, over = kill(process, rng.choice(VICTIMS), rng.random())
                victims.append(victim)
        if process.poll() == 0:
            return groups, victims
        assert len(victims) > before, "ended badly by itself"
        process.wait()  # where the last kill met a job
    process = start(folder)
    assert process.wait() == 0
    return [*groups, process.pid], victims


def orphans(groups):
    """Processes of these groups that still run."""
    found = []
    for process in psutil.process_iter():
        try:
            if os.getpgid(process.pid) in groups and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
        except (psutil.Error, OSError):
            continue
    return found


def wait_for_orphans(groups, seconds=LAST_ORPHAN):
    """Orphans that have not ended within some seconds."""
    end = time.monotonic() + seconds
    while (left := orphans(groups)) and time.monotonic() < end:
        time.sleep(0.5)
    return left


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


@pytest.mark.long
def test_a_campaign_that_is_killed_ends_as_an_undisturbed_one(tmp_path):
    whole, killed = checkout(tmp_path / "whole"), checkout(tmp_path / "killed")
    assert start(whole).wait() == 0
    groups, victims = disturbed(killed)
    assert "job" in victims
    assert wait_for_orphans(groups) == []
    assert left_behind(killed) == []
    assert list(faults_of(killed / "results")) == []
    expected, found = outcome(whole), outcome(killed)
    assert sorted(found) == sorted(expected)
    assert [name for name in expected if found[name] != expected[name]] == []


STUDY = """name: {name}
tests: {{ ball: {{ experiment: drop }} }}
factors: factors.tsv
measurements: measured.csv
calibrate: {{ to: {{ rebound_height_mm: {{}} }} }}
run:
  materials: {{ particle: {{ density_kg_m3: 2500, shear_modulus_Pa: 1.0e+7, poisson_ratio: 0.2 }} }}
  particles: {{ count: 1, diameter_mm: 2.0 }}
  geometry: {{ drop_height_mm: 5.0, drops: 2 }}
screening: {{ kind: plackett_burman, runs: 4, replicates: 2 }}
runs_per_job: 4
"""
TARGET = "screening"


def study(folder, name="drops"):
    """A folder with a study of eight drops in two batches; no results."""
    checkout(folder)
    (folder / "factors.tsv").write_text(FACTORS)
    (folder / "measured.csv").write_text(MEASURED)
    (folder / "study.yaml").write_text(STUDY.format(name=name))
    return folder


def command(target=TARGET):
    return [sys.executable, "-m", "snakemake", "-j2", "--configfile", "study.yaml", "--", target]


def campaign(folder, target=TARGET, before="", **options):
    """The campaign in a process, after the shell's commands `before`; what it said, both streams
    together, as `stdout`."""
    words = [f"'{word}'" for word in command(target)]
    return subprocess.run(
        ["bash", "-c", f"{before}\nexec {' '.join(words)}"], cwd=folder,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options,
    )  # fmt: skip


def started(folder):
    """The campaign under way."""
    with open(folder / "campaign.log", "a") as log:
        return subprocess.Popen(command(), cwd=folder, stdout=log, stderr=log)


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
    words = " ".join(f"'{word}'" for word in command())
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


@pytest.mark.long
def test_a_folder_that_can_only_be_read(undisturbed, mounts, tmp_path):
    study(tmp_path)
    (tmp_path / "results").mkdir()
    words = " ".join(f"'{word}'" for word in command())
    script = f"""
        mount --bind results results && mount -o remount,ro,bind results || exit 3
        {words} > readonly.log 2>&1 && exit 1
        exit 0
    """
    done = subprocess.run([*mounts, "bash", "-c", script], cwd=tmp_path, check=False)
    said = (tmp_path / "readonly.log").read_text()
    assert done.returncode == 0, said
    assert tells(said, str(tmp_path / "results"), os.strerror(errno.EROFS))
    assert "Traceback" not in said
    assert finished(tmp_path) == undisturbed


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
