"""A campaign under each fault that a machine has in store: it ends with a sentence and not with a
traceback, and a clean finish is equal to an undisturbed one. `test_kills.py` kills it."""

import errno
import os
import shutil
import subprocess
import sys
import time

import pytest
from deployed import FACTORS, MEASURED
from kills import checkout, outcome

from dem.kernel_cache import kernel_cache
from facts import tells

pytestmark = pytest.mark.slow

STUDY = """name: {name}
experiment: drop
factors: factors.tsv
measurements: measured.csv
target: {{ metric: rebound_height_mm, low: 0, high: 6 }}
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


def waited_for(condition, seconds=900.0):
    """Whether something happened in time."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


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


@pytest.mark.parametrize(
    "what",
    [
        "results/runs",
        pytest.param("results", marks=pytest.mark.long),
        pytest.param("results/drops", marks=pytest.mark.long),
    ],
)
def test_results_that_are_removed_under_way(undisturbed, tmp_path, what):
    study(tmp_path)
    process = started(tmp_path)
    assert waited_for(lambda: any(tmp_path.glob("results/runs/*/result.json")))
    shutil.rmtree(tmp_path / what, ignore_errors=True)
    process.wait()
    assert finished(tmp_path) == undisturbed


def test_two_calls_in_one_folder(undisturbed, tmp_path):
    study(tmp_path)
    process = started(tmp_path)
    assert waited_for((tmp_path / "results" / "drops" / "screening" / "plan.json").exists)
    second = campaign(tmp_path)
    assert process.wait() == 0, (tmp_path / "campaign.log").read_text()
    assert second.returncode != 0
    assert "another call" in second.stdout
    assert "Traceback" not in second.stdout
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


def test_a_clock_that_goes_back(undisturbed, tmp_path):
    """What has been made so far is dated tomorrow: it stays, and the rest is made."""
    study(tmp_path)
    half = campaign(tmp_path, "results/drops/screening/batches/0.json")
    assert half.returncode == 0, half.stdout
    tomorrow = time.time() + 86_400
    for path in (tmp_path / "results").rglob("*"):
        os.utime(path, (tomorrow, tomorrow))
    made = {p: p.stat().st_ino for p in tmp_path.glob("results/runs/*/result.json")}
    assert len(made) == 4
    assert finished(tmp_path) == undisturbed
    assert made == {p: p.stat().st_ino for p in made}


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


@pytest.mark.long
def test_two_gigabytes_of_address_space(undisturbed, tmp_path):
    done = campaign(study(tmp_path), before="ulimit -v 2000000")
    assert done.returncode == 0, done.stdout
    assert outcome(tmp_path) == undisturbed
