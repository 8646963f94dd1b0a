"""Recording of what the verification tests measured: `pytest tests/verification -m "" --record`.

Each test hands its values and figures on with its report, whatever process it runs in. They stand
in results/release until every test has passed, so that a recording that was cut off goes on with
the tests that are left; then docs/verification.json and docs/verification/ are written. Tests that
did not run (left out by a mark, a file or a name, or skipped) keep what they recorded before, with
the engine that gave it; what belongs to a test that no longer exists is dropped.
"""

import hashlib
import json
from pathlib import Path

import pytest

from calibration.files import write_text
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from facts import ROOT

RECORD, FIGURE = "verification record", "verification figure"  # names of a report's properties


def name_of(nodeid):
    """A test's name in the record: its file and what follows."""
    return nodeid.split("/")[-1]


class Recorder:
    """Plugin of one recording: gathers what arrives with the reports, and writes it at the end."""

    def __init__(self, config, root=ROOT):
        self.config = config
        self.docs, self.partial = root / "docs", root / "results/release/verification.jsonl"
        self.engine = engine_fingerprint()
        self.known, self.passed = set(), set()
        self.ran = self._cut_off()

    def _cut_off(self):
        """{test: what it handed on} of a recording of this engine that was cut off."""
        if not self.partial.exists():
            return {}
        lines = [json.loads(line) for line in self.partial.read_text("utf-8").splitlines()]
        return {line["test"]: line for line in lines if line["engine"] == self.engine}

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, config, items):
        """Note every test before marks and names take some out; leave out what is recorded."""
        self.known.update(name_of(item.nodeid) for item in items)
        for item in items:
            if self.ran.get(name_of(item.nodeid), {}).get("code") not in (None, _code(item.path)):
                del self.ran[name_of(item.nodeid)]
        done = [item for item in items if name_of(item.nodeid) in self.ran]
        items[:] = [item for item in items if name_of(item.nodeid) not in self.ran]
        config.hook.pytest_deselected(items=done)

    def pytest_runtest_logreport(self, report):
        """Keep what a test handed on, once it has passed and its figures are drawn."""
        test = name_of(report.nodeid)
        if report.when == "call" and report.passed:
            self.passed.add(test)
        if report.when != "teardown" or not report.passed or test not in self.passed:
            return
        handed = {
            kind: [value for name, value in report.user_properties if name == kind]
            for kind in (RECORD, FIGURE)
        }
        code = _code(self.config.rootpath / report.location[0])
        self.ran[test] = {"test": test, "engine": self.engine, "code": code, **handed}
        if not hasattr(self.config, "workerinput"):
            self.partial.parent.mkdir(parents=True, exist_ok=True)
            with open(self.partial, "a", encoding="utf-8") as stream:
                stream.write(json.dumps(self.ran[test], allow_nan=False) + "\n")

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node, error):
        """Take over which tests a process of xdist knows; one that crashed has no output."""
        self.known.update(getattr(node, "workeroutput", {}).get("known tests", ()))

    def pytest_sessionfinish(self, session, exitstatus):
        """Write the record and the figures, where every test that ran has passed."""
        if hasattr(self.config, "workerinput"):
            self.config.workeroutput["known tests"] = sorted(self.known)
        elif exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            self._write()

    def _write(self):
        path = self.docs / "verification.json"
        old = json.loads(path.read_text("utf-8")) if path.exists() else []
        new = [record for handed in self.ran.values() for record in handed[RECORD]]
        write_json(path, _in_old_order(self._kept(old) + new, old))
        for handed in self.ran.values():
            for name, drawn in handed[FIGURE]:
                write_text(drawn, self.docs / "verification" / f"{name}.svg")
        self.partial.unlink(missing_ok=True)

    def _kept(self, old):
        """Records of tests that still exist, or whose file was not looked at, and did not pass
        now."""
        files = {name.split("::")[0] for name in self.known}
        return [
            record
            for record in old
            if record["test"] not in self.ran
            and (record["test"] in self.known or record["test"].split("::")[0] not in files)
        ]


def _code(path):
    """Digest of a file of tests."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]


def _in_old_order(records, old):
    """Records with each test where it stood, so that a recording changes only what has changed; new
    tests last, by name."""
    place = {test: k for k, test in enumerate(dict.fromkeys(record["test"] for record in old))}

    def key(record):
        return place.get(record["test"], len(place)), record["test"]

    return sorted(records, key=key)
