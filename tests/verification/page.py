"""Writes docs/verification.md from docs/verification.json, which `pytest tests/verification --record` leaves."""

import json
from itertools import groupby
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"

HEAD = """# Verification

Every law of the engine against something that nobody here wrote: closed forms, published benchmarks, measurements. This
page is generated from the tests' own results:

    .venv/bin/pytest tests/verification --record && .venv/bin/python tests/verification/page.py

A test fails when a value is further from its reference than the tolerance; the reason for each tolerance stands beside
it in the test. Beyond the tables, `tests/verification/test_invariants.py` draws random collisions and checks that
momentum, angular momentum and energy are kept or lost as they must be, that no rolling torque reverses a spin, that the
outcome does not depend on rotation, reflection, relabelling, a Galilean boost or the skin of the pair list, that the
list holds exactly the pairs within reach, and that a restored state has the same future to the bit. EDEM's own-spin
rolling torque does not keep angular momentum; the test measures that the loss is mu_r R times the normal impulse.
`tests/unit/test_resume.py` kills a heap at random moments and finds its end the same to the bit.

A value in bold is outside its tolerance: a known fault, marked as an expected failure in its test.

Not verified here yet: trends of bulk flow (Zhou et al. 2002, Beverloo, Janssen), the cost of the default numerics in
degrees with its spread over seeds, and heaps against those of LIGGGHTS under the same law.
"""


def main():
    records = sorted(json.loads((DOCS / "verification.json").read_text()), key=lambda r: r["topic"])
    lines = [HEAD]
    for topic, rows in groupby(records, key=lambda r: r["topic"]):
        lines += [
            f"## {topic[0].upper()}{topic[1:]}",
            "",
            "| what | engine | reference | tolerance | source |",
            "|---|---|---|---|---|",
        ]
        for r in rows:
            unit = f" {r['unit']}" if r["unit"] else ""
            figures = [
                f"{r[k]:.{digits}g}{unit}"
                for k, digits in (("value", 5), ("reference", 5), ("tolerance", 2))
            ]
            if abs(r["value"] - r["reference"]) > r["tolerance"]:
                figures[0] = f"**{figures[0]}**"
            lines.append(f"| {' | '.join([r['quantity'], *figures, r['source']])} |")
        lines.append("")
    (DOCS / "verification.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
