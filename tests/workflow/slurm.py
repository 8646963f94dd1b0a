"""A cluster of one node: SLURM as Debian packages it, on the loopback, for as long as a test takes.
It keeps no accounts, as many small clusters do."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

PROGRAMS = ("mungekey", "munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scontrol")
CONFIGURATION = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
CommunicationParameters=NoInAddrAny
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName={host} NodeAddr=127.0.0.1 CPUs=1 RealMemory={memory_mb}
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
START_S = 30.0


def missing():
    """Names of SLURM's programs that are not installed."""
    return [name for name in PROGRAMS if _path(name) is None]


@contextmanager
def cluster():
    """A running cluster; yields the environment in which its commands find it."""
    # the path of a socket is at most 107 characters long, so it is not below the test's own folder
    folder = Path(tempfile.mkdtemp(prefix="slurm"))
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
    started = []

    def start(name, *options):
        with open(folder / f"{name}.log", "w") as log:
            command = [_path(name), *options]
            process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
        started.append(process)

    try:
        _write(folder)
        munge = {"socket": "munge.socket", "key-file": "key", "pid-file": "munge.pid"}
        munge |= {"log-file": "munge.log", "seed-file": "munge.seed"}
        options = [f"--{option}={folder / file}" for option, file in munge.items()]
        start("munged", "--foreground", "--force", *options)
        _until(lambda: (folder / "munge.socket").exists(), folder)
        start("slurmctld", "-D")
        start("slurmd", "-D")
        _until(lambda: "idle" in _said("sinfo", "--noheader", "-o%T", env=environment), folder)
        yield environment
    finally:
        _said("scancel", f"--user={_user()}", env=environment)
        with suppress(TimeoutError):
            _until(lambda: not _said("squeue", "--noheader", env=environment).strip(), folder)
        for process in reversed(started):
            process.terminate()
            process.wait()
        shutil.rmtree(folder, ignore_errors=True)


def _write(folder):
    for name in ("state", "spool", "bin"):
        (folder / name).mkdir()
    # the plugin takes SLURM's variables from the environment of its steps, that of our file as well
    step = folder / "bin" / "srun"
    step.write_text(f'#!/bin/sh\nSLURM_CONF={folder}/slurm.conf exec {_path("srun")} "$@"\n')
    step.chmod(0o755)
    subprocess.run([_path("mungekey"), "--create", f"--keyfile={folder / 'key'}"], check=True)
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20
    text = CONFIGURATION.format(
        host=socket.gethostname().split(".")[0],
        ports=_free_ports(2), folder=folder, user=_user(), memory_mb=memory,
    )  # fmt: skip
    (folder / "slurm.conf").write_text(text)


def _user():
    return pwd.getpwuid(os.getuid()).pw_name


def _free_ports(count):
    """Ports of the loopback that nobody listens to."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


def _path(name):
    """Of a program; daemons are not on everybody's path."""
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin")


def _said(name, *options, env):
    found = subprocess.run([name, *options], env=env, capture_output=True, text=True, check=False)
    return found.stdout


def _until(condition, folder):
    end = time.monotonic() + START_S
    while not condition():
        if time.monotonic() > end:
            logs = "\n".join(p.read_text(errors="replace") for p in folder.glob("*.log"))
            raise TimeoutError(f"SLURM does not answer within {START_S:g} s\n{logs}")
        time.sleep(0.2)
