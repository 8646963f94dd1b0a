"""Recording of what the verification tests measured.

`pytest tests/verification -n 0 -m "" --record` writes docs/verification.json and the figures in
docs/verification/. Tests that did not run (left out by a mark, a file or a name) keep what they
recorded before, with the engine that gave it; what belongs to a test that no longer exists is
dropped.
"""

import json
import os
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from calibration.figures import STYLE, save
from dem.fingerprint import engine_fingerprint

DOCS = Path(__file__).parents[2] / "docs"
RECORDS, FIGURES = [], {}
COLLECTED, RAN = set(), set()


def _name(nodeid):
    return nodeid.split("/")[-1]


@pytest.fixture
def record(request):
    """record(topic, quantity, value, reference, tolerance, unit, source): assert |value -
    reference| <= tolerance.

    reference None: nothing to compare with. tolerance None: shown beside the reference and not
    judged.
    """

    def check(topic, quantity, value, reference, tolerance, unit="", source="closed form"):
        RECORDS.append(
            {
                "topic": topic,
                "quantity": quantity,
                "value": float(value),
                "reference": None if reference is None else float(reference),
                "tolerance": None if tolerance is None else float(tolerance),
                "unit": unit,
                "source": source,
                "test": _name(request.node.nodeid),
                "engine": engine_fingerprint(),
            }
        )
        if tolerance is not None:
            assert abs(value - reference) <= tolerance, (
                f"{quantity}: {value:.6g} against {reference:.6g} {unit}"
            )

    return check


@pytest.fixture
def figure(request):
    """figure(topic, name, caption, columns=1): matplotlib figure and axes of
    docs/verification/<name>.svg."""
    drawn = []

    def new(topic, name, caption, columns=1):
        with plt.rc_context(STYLE):
            fig, axes = plt.subplots(
                1, columns, figsize=(5.6 if columns == 1 else 9.6, 3.8), layout="constrained"
            )
        drawn.append(fig)
        FIGURES[name] = fig
        RECORDS.append(
            {
                "topic": topic,
                "figure": name,
                "caption": caption,
                "test": _name(request.node.nodeid),
                "engine": engine_fingerprint(),
            }
        )
        return fig, axes

    yield new
    if not request.config.getoption("--record"):
        for fig in drawn:
            plt.close(fig)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Note every test before marks and names take some out."""
    COLLECTED.update(_name(item.nodeid) for item in items)


def pytest_runtest_logreport(report):
    if report.when == "call":
        RAN.add(_name(report.nodeid))


def _kept(old):
    """Records of tests that still exist, or whose file was not looked at, and did not run now."""
    files = {name.split("::")[0] for name in COLLECTED}
    return [
        r
        for r in old
        if r["test"] not in RAN
        and (r["test"] in COLLECTED or r["test"].split("::")[0] not in files)
    ]


def _in_old_order(records, old):
    """Records with each test where it stood, so that a recording changes only what has changed; new
    tests last."""
    place = {test: k for k, test in enumerate(dict.fromkeys(r["test"] for r in old))}
    return sorted(records, key=lambda r: place.get(r["test"], len(place)))


def pytest_sessionfinish(session, exitstatus):
    if not session.config.getoption("--record", default=False) or exitstatus != 0:
        return
    path = DOCS / "verification.json"
    old = json.loads(path.read_text()) if path.exists() else []
    partial = path.with_suffix(".partial")
    records = _in_old_order(_kept(old) + RECORDS, old)
    partial.write_text(json.dumps(records, indent=1, allow_nan=False) + "\n")
    os.replace(partial, path)
    for name, fig in FIGURES.items():
        save(fig, DOCS / "verification" / f"{name}.svg")
