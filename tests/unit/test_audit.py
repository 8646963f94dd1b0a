import csv
import shutil
from fnmatch import fnmatch

import numpy as np
import pandas as pd
import pytest

from facts import ROOT, refused
from paper.audit import COLUMNS, AuditInputError, run_audit, write_audit
from paper.audit.bench import stepped_restitution
from paper.audit.paper import Found

SHIPPED, CORRECTED = ROOT / "data/paper", ROOT / "tests/corrected_paper"


class Folder:
    """A copy of the printed tables with every error put right, whose cells can be set."""

    def __init__(self, path):
        self.path = shutil.copytree(SHIPPED, path)
        shutil.copytree(CORRECTED, path, dirs_exist_ok=True)

    def write(self, name, rows):
        with open(self.path / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)

    def set(self, name, key, column, value):
        """Set one cell of the row whose first column is `key`."""
        with open(self.path / f"{name}.csv", newline="", encoding="utf-8") as file:
            head, *body = (r for r in csv.reader(file) if r and not r[0].startswith("#"))
        row = next(row for row in body if row[0] == str(key))
        row[head.index(column)] = str(value)
        self.write(name, [head, *body])


@pytest.fixture(scope="module")
def shipped():
    return run_audit(SHIPPED).set_index("id")


def disagreeing(folder):
    table = run_audit(folder)
    return set(table.id[table.verdict == "disagrees"])


def within(table, prefix):
    return table[table.index.str.startswith(prefix)]


# --- the paper as printed -------------------------------------------------------------------------


def test_every_row_is_complete(shipped):
    assert list(shipped.reset_index().columns) == list(COLUMNS)
    assert shipped.verdict.isin(["agrees", "disagrees", "not_computable"]).all()
    assert (shipped["where"].str.len() > 0).all()
    assert (shipped.consequence.str.len() > 0).all()
    assert not shipped.consequence.str.contains("nan|None ").any()


CLAIMS = {
    "agrees": """
        table07.* table08.[!t]* table09.high table09.step table10.* table12.[!h]* table13.*
        tilt.inverse tilt.refit tilt.error drop.inverse drop.contact.4mm model.highly
        model.significant optimum.regression validation.mean validation.error eq5.* eq6.* eq8.*
    """,
    "disagrees": """
        section11.* table01.mean table02.sum.group1 table03.particle table04.unit.salt_density
        table05.* table06.coded table09.groups table09.low table09.range table09.height.*
        table11.rank table11.misprints table12.heading.* eq2.* eq4.* eq9.* eq21.* eq23.* eq28.*
        tilt.r2 drop.r2 drop.error drop.refit drop.direct drop.contact.2mm drop.time_step.*
        ascent.start.* ascent.low ascent.high optimum.eq28 interaction.* conclusion.*
        section122.restitution validation.replicates validation.repeats labels.unique
        reference.target
    """,
    "not_computable": """
        tilt.bench tilt.simulated drop.bench drop.simulated shear.slope shear.intercept
        shear.particle section235.poisson
    """,
}
"""Verdict -> claims, as patterns of file names; readings that are not printed are not judged."""


@pytest.mark.parametrize("verdict", CLAIMS)
def test_claims_have_their_verdicts(shipped, verdict):
    for pattern in CLAIMS[verdict].split():
        found = shipped[[fnmatch(claim, pattern) for claim in shipped.index]]
        assert set(found.verdict) == {verdict}, pattern


def test_every_cell_is_judged(shipped):
    counts = {"table07.": 43, "table09.height.": 9, "table12.": 70, "eq28.": 9}
    assert {prefix: len(within(shipped, prefix)) for prefix in counts} == counts
    assert (shipped.verdict == "not_computable").sum() == 8


RECOMPUTED = {
    "table03.particle": pytest.approx(2160, abs=10),  # the crystal; the salt's is a bulk density
    "table09.law": 0,  # of the nine heights none is that of the restitution
    "table11.rank": 9,
    "table11.misprints": 9,
    "drop.error": pytest.approx(10.93, abs=0.005),  # ten times the printed one
    "drop.contact.2mm": pytest.approx(1.03e-5, rel=0.01),  # shorter than the step
    "model.highly": "A B C BC A2",
    "model.significant": "AB AC",
    "interaction.highly": "BC",
    "interaction.significant": "AB AC",
    "conclusion.highly": "BC",
    "eq28.terms": "A B C AB AC BC A2",
    "table07.highly": "C E G",
}


def test_values_are_computed_anew(shipped):
    assert shipped.loc[list(RECOMPUTED), "recomputed"].to_dict() == RECOMPUTED


# --- errors put right, and planted ----------------------------------------------------------------


def test_corrected_tables_agree_throughout(tmp_path):
    table = run_audit(Folder(tmp_path / "right").path)
    assert len(table) > 290
    assert dict(table.verdict.value_counts()) == {"agrees": len(table)}


PLANTED = [
    # file, row, column, planted value, claims that must turn
    ("table01_printed_means", 3, "mean", "45.86", ["table01.mean.3"]),
    ("table02_sieve_fractions", 2, "0.3", "27.5", ["table02.sum.group2"]),
    ("table03_density", 2, "density_printed_kg_m3", "1232", ["table03.density.2", "table03.mean"]),
    ("table04_printed_units", "steel_density", "printed_unit", "kg m-2",
     ["table04.unit.steel_density"]),
    ("table05_contact_parameter_ranges", "D", "high", "0.36", ["table05.twice"]),
    ("table06_printed_levels", 1, "E_printed", "0.75", ["table06.coded"]),
    ("table07_plackett_burman_anova", "C", "F", "55.64", ["table07.C.F"]),
    ("table07_plackett_burman_anova", "A", "p", "0.0586", ["table07.A.p"]),
    ("table10_steepest_ascent", 4, "relative_error_printed", "0.12", ["table10.error.4"]),
    ("table10_steepest_ascent", 5, "angle_deg", "58.53", ["table10.error.5"]),
    ("table11_box_behnken", 5, "Y_printed", "-1", ["table11.misprints"]),
    ("table11_box_behnken", 17, "Y_printed", "-1", ["table11.misprints"]),
    ("table12_box_behnken_anova", "BC", "p", "0.0140", ["table12.BC.p"]),
    ("table12_box_behnken_anova", "Residual", "df", "8", ["table12.Residual.df"]),
    ("table12_summary", "R2_pred", "value", "0.93", ["table12.summary.R2_pred"]),
    ("table12_printed_headings", "sum_sq", "printed_heading", "mean square",
     ["table12.heading.sum_sq"]),
    ("table13_printed_means", 5, "mean", "45.322", ["table13.mean.5"]),
    ("scalars", "validated_angle_of_repose", "value", "45.95",
     ["validation.error", "validation.mean"]),
    ("scalars", "salt_salt_static_friction", "value", "0.58", ["shear.friction"]),
    ("scalars", "yield_locus_intercept", "value", "0.048", ["shear.intercept"]),
    ("scalars", "section_1_1_density", "value", "1210", ["section11.density"]),
    ("scalars", "simulated_duration", "value", "0.5", ["heap.generation"]),
    ("settings", "tilt_duration", "value", "8", ["tilt.reach"]),
    ("settings", "drop_duration", "value", "0.2", ["drop.duration"]),
    ("settings", "brine_water", "value", "50", ["table03.brine"]),
    ("settings", "simulated_tilt_angle", "value", "40.01",
     ["tilt.between", "tilt.error", "tilt.simulated"]),
    ("claims", "drop.error", "printed", "1.09", ["drop.error"]),
    ("claims", "interaction.highly", "printed", "AC BC", ["interaction.highly"]),
    ("claims", "conclusion.highly", "printed", "AB AC", ["conclusion.highly"]),
    ("claims", "validation.t_test", "printed", "<0.05", ["validation.t_test"]),
    ("claims", "table09.groups", "printed", "7", ["table09.groups"]),
    ("claims", "table09.low", "printed", "0.3", ["table09.low", "table09.range"]),
    ("claims", "table08.groups", "printed", "7", ["table08.groups"]),
    ("claims", "eq5.mass", "printed", "2", ["eq5.mass"]),
    ("claims", "eq9.signs", "printed", "- +", ["eq9.signs"]),
    ("claims", "model.highly", "printed", "A B C AC BC A2", ["model.highly"]),
    ("claims", "table07.others", "printed", "A B D", ["table07.others"]),
    ("claims", "fig9a.trend", "printed", "rises", ["fig9a.trend"]),
    ("claims", "tilt.r2", "printed", "0.9886", ["tilt.r2"]),
    ("cross_references", "anova", "cites", "Table 10", ["reference.anova"]),
    ("labels", "Table 12", "label", "Table 13", ["labels.unique", "reference.anova"]),
]  # fmt: skip


def test_planted_errors_turn_their_claims_and_no_other(tmp_path):
    folder = Folder(tmp_path / "planted")
    for file, row, column, value, _ in PLANTED:
        folder.set(file, row, column, value)
    assert disagreeing(folder.path) == {claim for *_, claims in PLANTED for claim in claims}


# --- inputs and outputs ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("file", "row", "column", "value", "facts"),
    [
        (
            "table09_drop_test",
            1,
            "rebound_height_mm",
            "16,2",
            {"path": "table09_drop_test.csv", "key": "row 1", "column": "rebound_height_mm",
             "value": "16,2"},
        ),
        ("claims", "eq5.mass", "id", "eq5.maas", {"path": "claims.csv"}),
        ("claims", "tilt.error", "printed", "=nothing", {"path": "scalars.csv", "key": "nothing"}),
        ("scalars", "drop_height", "value", "high", {"key": "drop_height", "value": "high"}),
    ],
)  # fmt: skip
def test_unreadable_input_is_named(tmp_path, file, row, column, value, facts):
    folder = Folder(tmp_path / "unreadable")
    folder.set(file, row, column, value)
    with refused(AuditInputError, **facts):
        run_audit(folder.path)


def test_missing_input_is_named(tmp_path):
    with refused(AuditInputError, path="nowhere"):
        run_audit(tmp_path / "nowhere")
    folder = Folder(tmp_path / "lacking")
    folder.write("labels", [["label", "meaning"]])
    with refused(AuditInputError, path="labels.csv", column="shows", allowed="label, meaning"):
        run_audit(folder.path)
    (folder.path / "table13_validation.csv").unlink()
    with refused(AuditInputError, path="table13_validation.csv"):
        run_audit(folder.path)


def test_written_files_hold_every_claim(shipped, tmp_path):
    table = shipped.reset_index()
    paths = [tmp_path / "out" / f"audit.{suffix}" for suffix in ("csv", "html")]
    write_audit(table, *paths)
    back = pd.read_csv(paths[0], dtype=str, keep_default_na=False)
    assert list(back.id) == list(table.id)
    assert list(back.printed) == list(table.printed)
    text = paths[1].read_text("utf-8")
    assert f"{len(table)} claims" in text
    assert all(claim in text for claim in table.id)
    assert sorted(p.name for p in paths[0].parent.iterdir()) == ["audit.csv", "audit.html"]


# --- parts of the audit ---------------------------------------------------------------------------


def test_verdict_follows_the_printed_place():
    for printed, found, holds in (
        ("0.50", Found(0.5049), True),
        ("0.50", Found(0.5051), False),
        ("0.5", Found(0.5499), True),
        ("0.50", Found(0.5051, half_width=0.001), True),
        ("0.3", Found(0.35, exact=True), False),
        ("3", Found(2), False),
        ("3", Found(np.int64(2)), False),
        ("<0.01", Found(0.009), True),
        ("<0.01", Found(0.0101), False),
        (">0.05", Found(0.04), False),
        ("A B", Found("A B"), True),
        ("A B", Found(None), None),
        ("0.3", Found(float("nan")), False),
    ):
        assert found.compared(printed)[0] == holds


def test_many_steps_give_the_nominal_restitution_and_few_do_not():
    e = np.array([0.2, 0.5, 0.8])
    fine, coarse = stepped_restitution(e, 2000, phases=4), stepped_restitution(e, 3)
    assert fine == pytest.approx(np.broadcast_to(e[:, None], fine.shape), abs=2e-3)
    assert np.ptp(coarse, axis=1).min() > 20 * np.ptp(fine, axis=1).max()
