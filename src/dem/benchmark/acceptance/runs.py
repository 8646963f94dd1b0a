"""The runs of one engine, in a process of its own that imports nothing but that engine."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tarfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

from dem.errors import DemError

WORKER = """
import json, sys
from pathlib import Path
from dem.errors import DemError
from dem.fingerprint import engine_fingerprint
from dem.run import run
from dem.spec import parse_spec
from dem.warm import compile_engine
out = Path(sys.argv[1]) / engine_fingerprint()
compile_engine()
print(json.dumps({"engine": engine_fingerprint()}), flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    try:
        result = run(parse_spec(asked["spec"]), out / asked["name"], again=False)
        found = {"value": result["metrics"][asked["metric"]],
                 "seconds": result["numerics"]["wall_time_s"]}
    except DemError as error:
        found = {"lost": str(error)}
    print(json.dumps({"name": asked["name"], **found}), flush=True)
"""
"""It uses only what every engine of this project has."""


class Engine:
    """A checkout and the worker that makes its runs, which are kept below `out`."""

    def __init__(self, given: str, out: Path) -> None:
        self.given, self.folder = given, checkout(given, Path(out) / "checkouts")
        self.process = subprocess.Popen(
            [sys.executable, "-c", WORKER, str(Path(out) / "runs")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self.environment,
        )

    @property
    def environment(self) -> dict[str, str]:
        """Environment of a process in which this checkout's packages are imported."""
        return os.environ | {"PYTHONPATH": str(self.folder / "src")}

    def fingerprint(self) -> str:
        """The engine's, once it is compiled."""
        return self._answer()["engine"]

    def ask(self, name: str, spec: Mapping[str, Any], metric: str) -> None:
        """Have a run made; `answer` waits for it."""
        print(json.dumps({"name": name, "spec": spec, "metric": metric}), file=self.process.stdin,
              flush=True)  # fmt: skip

    def answer(self) -> dict[str, Any]:
        """What the run that was asked for first came to: {name, value, seconds} or {name, lost}."""
        return self._answer()

    def _answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise DemError(f"{self.given}: its engine ended with an error (above)")
        return json.loads(line)

    def close(self) -> None:
        """End the worker."""
        self.process.stdin.close()  # type: ignore[union-attr]
        self.process.wait()


def checkout(given: str, folder: Path) -> Path:
    """Path of a checkout: `given` itself where it is one, else the git revision of that name,
    written below `folder`. Raises DemError where it is neither."""
    path = Path(given)
    if (path / "src" / "dem").is_dir():
        return path.resolve()
    if path.is_dir():
        raise DemError(f"{given}: has no src/dem; allowed: a checkout or a git revision")
    found = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", f"{given}^{{commit}}"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if found.returncode:
        raise DemError(f"{given}: is neither a folder nor a git revision of this folder's project")
    commit = found.stdout.strip()
    target = (folder / commit[:12]).resolve()
    if not target.is_dir():
        partial = target.with_suffix(".partial")
        archive = subprocess.run(["git", "archive", commit], capture_output=True, check=True).stdout
        with tarfile.open(fileobj=BytesIO(archive)) as files:
            files.extractall(partial, filter="data")
        partial.rename(target)
    return target


def closed_forms(engine: Engine, fingerprint: str, out: Path) -> tuple[bool, str]:
    """Run the verification tests of a checkout that need no other program and no minutes. Returns
    (whether they hold, the last line of their output). What has passed stands in `out` under the
    content of engine and tests, and is not run again. Raises DemError where the tests cannot be
    run."""
    tests = engine.folder / "tests" / "verification"
    if not tests.is_dir():
        raise DemError(f"{engine.given}: has no tests/verification")
    digest = hashlib.sha256(fingerprint.encode())
    for path in sorted(tests.rglob("*.py")):
        digest.update(path.read_bytes())
    mark = Path(out) / "closed_forms" / digest.hexdigest()[:16]
    if mark.is_file():
        return True, mark.read_text().strip()
    command = ["-m", "pytest", str(tests), "-n", "0", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [sys.executable, *command], cwd=engine.folder, env=engine.environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.strip()]
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    said = "; ".join([*failed[:5], lines[-1] if lines else done.stderr.strip()[-300:]])
    if done.returncode == 0:
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.write_text(said + "\n")
    return done.returncode == 0, said
