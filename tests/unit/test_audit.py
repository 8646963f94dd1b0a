import csv
from fnmatch import fnmatch

import pandas as pd
import pytest
from audit_corrections import SHIPPED, Folder, corrected

from facts import refused
from paper.audit import COLUMNS, AuditInputError, run_audit, write_audit


@pytest.fixture(scope="module")
def shipped():
    return run_audit(SHIPPED).set_index("id")


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """Path of a corrected copy."""
    return corrected(tmp_path_factory.mktemp("audit") / "paper").path


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
        model.significant optimum.regression validation.mean validation.error
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


def test_tolerance_is_that_of_the_printed_digits(shipped):
    assert shipped.loc["table12.A.F", "tolerance"] == pytest.approx(0.05)
    assert shipped.loc["table12.BC.p", "tolerance"] == pytest.approx(0.00005)
    assert shipped.loc["validation.error", "tolerance"] == pytest.approx(0.05)


# --- errors put right, and planted ----------------------------------------------------------------


def test_corrected_tables_agree_throughout(right):
    table = run_audit(right)
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


def test_planted_errors_turn_their_claims_and_no_other(right, tmp_path):
    folder = Folder(tmp_path / "planted", right)
    for file, row, column, value, _ in PLANTED:
        folder.set(file, row, column, value)
    assert disagreeing(folder.path) == {claim for *_, claims in PLANTED for claim in claims}


SPREADING = [
    # file, row, column, planted value, a claim that must turn, and the only claims that may
    ("table08_inclined_plane", 2, "angle_deg", "29.23", "table08.tangent.2",
     ("table08.", "eq21.", "tilt.")),
    ("table09_drop_test", 4, "rebound_height_mm", "30.26", "table09.height.4",
     ("table09.", "eq23.", "drop.")),
    ("table11_box_behnken", 6, "angle_deg", "46.8", "table12.A.F",
     ("table12.", "eq28.", "model.", "optimum.", "inter")),
    ("table06_plackett_burman", 3, "angle_deg", "51.52", "table07.G.F", ("table07.", "ascent.")),
    ("table13_validation", 4, "angle_deg", "54.61", "validation.mean", ("table13.", "validation.")),
    ("scalars", "drop_test_time_step", "value", "1e-3", "drop.contact.2mm", ("drop.",)),
    ("scalars", "eq28_coefficients", "value", "45.88 A:1.6588", "eq28.1", ("eq28.", "optimum.")),
    ("dimensionless_groups", "pi2", "exponent", "2", "eq15.pi2", ("eq15.pi2", "section122.")),
]  # fmt: skip


@pytest.mark.parametrize(("file", "row", "column", "value", "expected", "allowed"), SPREADING)
def test_an_error_in_the_data_turns_what_rests_on_it(
    right, tmp_path, file, row, column, value, expected, allowed
):
    folder = Folder(tmp_path / "planted", right)
    folder.set(file, row, column, value)
    turned = disagreeing(folder.path)
    assert expected in turned
    others = {claim for claim in turned if not claim.startswith(allowed)}
    assert others <= {"conclusion.highly", "fig9b.growth"}


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
def test_unreadable_input_is_named(right, tmp_path, file, row, column, value, facts):
    folder = Folder(tmp_path / "unreadable", right)
    folder.set(file, row, column, value)
    with refused(AuditInputError, **facts):
        run_audit(folder.path)


def test_missing_input_is_named(right, tmp_path):
    with refused(AuditInputError, path="nowhere"):
        run_audit(tmp_path / "nowhere")
    folder = Folder(tmp_path / "lacking", right)
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
    assert sorted(p.name for p in paths[0].parent.iterdir()) == [
        "audit.csv",
        "audit.html",
    ]


def test_levels_restored_from_the_print_are_those_of_the_copied_table():
    from paper.audit.paper import Paper
    from paper.audit.surface import restored_levels

    with open(SHIPPED / "table11_box_behnken.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert restored_levels(Paper(SHIPPED)).tolist() == [
        [float(r[axis]) for axis in "XYZ"] for r in rows
    ]
