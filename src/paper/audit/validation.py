"""Table 13 and Section 3: the simulated angle at the optimum against the measured one."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from scipy import stats

from paper.audit.intrinsic import group_means
from paper.audit.paper import Claim, Paper
from paper.audit.verdict import Recomputed, claim_check, table_check

RUNS = "table13_validation"


def _runs(paper: Paper) -> pd.DataFrame:
    return paper.numbers(RUNS, "group", "replicate", "angle_deg")


@table_check
def simulated_group_means(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    yield from group_means(paper, _runs(paper), "Table 13", "Mean simulated angle")


@claim_check("validation.mean")
def total_mean(paper: Paper, claim: Claim) -> Recomputed:
    return Recomputed(float(_runs(paper).angle_deg.mean()))


@claim_check("validation.replicates")
def replicates(paper: Paper, claim: Claim) -> Recomputed:
    n = len(_runs(paper))
    return Recomputed(
        n,
        disagrees=f"Table 13 has {n} angles: its rows are groups, and the text counts groups as "
        f"runs.",
    )


@claim_check("validation.repeats")
def repeats(paper: Paper, claim: Claim) -> Recomputed:
    """Chance of at least the printed number of equal neighbours in a group, for independent normal
    angles."""
    runs = _runs(paper)
    neighbours = runs.groupby("group").angle_deg.diff().dropna()
    equal = int((neighbours.abs() < 1e-9).sum())
    resolution = 2 * max(
        cell.half_unit for cell in paper.printed(RUNS, "angle_deg") if "." in cell.text
    )
    # Two readings of N(m, s) fall on the same step of the scale with the density of their
    # difference at 0.
    chance_each = min(1.0, resolution / (2 * np.sqrt(np.pi) * runs.angle_deg.std()))
    chance = float(stats.binom.sf(equal - 1, len(neighbours), chance_each))
    return Recomputed(
        chance,
        agrees=f"{equal} of {len(neighbours)} neighbours are equal.",
        disagrees=f"{equal} of {len(neighbours)} neighbouring angles are equal to the last digit: "
        f"repeated entries, so "
        "the table holds fewer independent runs than values and its scatter is understated.",
    )


@claim_check("validation.error")
def relative_error(paper: Paper, claim: Claim) -> Recomputed:
    measured = paper.value("measured_angle_of_repose")
    return Recomputed(100 * abs(paper.value("validated_angle_of_repose") - measured) / measured)


@claim_check("validation.t_test")
def t_test(paper: Paper, claim: Claim) -> Recomputed:
    measured = paper.angles()
    simulated = _runs(paper)
    welch = stats.ttest_ind(simulated.angle_deg, measured.angle_deg, equal_var=False)
    groups = stats.ttest_ind(
        *(t.groupby("group").angle_deg.mean() for t in (simulated, measured)), equal_var=False
    )
    low, high = welch.confidence_interval()
    return Recomputed(
        float(welch.pvalue),
        agrees=f"Welch over all readings; p = {groups.pvalue:.2f} over group means. No difference "
        f"shown is not "
        f"equality: the 95 % interval of simulated minus measured is {low:+.2f} to {high:+.2f} "
        f"deg.",
        disagrees=f"The angles differ: the 95 % interval of simulated minus measured is {low:+.2f} "
        f"to {high:+.2f} deg.",
    )
