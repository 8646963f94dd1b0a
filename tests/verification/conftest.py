"""Recording of what the verification tests measured; `pytest tests/verification --record` writes
docs/verification.json."""

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RECORDS = []


@pytest.fixture
def record(request):
    """record(topic, quantity, value, reference, tolerance, unit, source): assert |value - reference| <= tolerance."""

    def check(topic, quantity, value, reference, tolerance, unit="", source="closed form"):
        RECORDS.append(
            {
                "topic": topic,
                "quantity": quantity,
                "value": float(value),
                "reference": float(reference),
                "tolerance": float(tolerance),
                "unit": unit,
                "source": source,
                "test": request.node.nodeid.split("/")[-1],
            }
        )
        assert abs(value - reference) <= tolerance, (
            f"{quantity}: {value:.6g} against {reference:.6g} {unit}"
        )

    return check


def pytest_sessionfinish(session, exitstatus):
    if session.config.getoption("--record", default=False) and exitstatus == 0:
        (ROOT / "docs" / "verification.json").write_text(json.dumps(RECORDS, indent=1) + "\n")
