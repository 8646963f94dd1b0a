"""Whether each cited equation or table shows what the citing sentence is about."""

from collections.abc import Iterator

from paper.audit.paper import Claim, Paper
from paper.audit.verdict import Recomputed, claim_check, table_check


@table_check
def citations(paper: Paper) -> Iterator[tuple[Claim, Recomputed]]:
    labels = paper.text("labels", "label", "shows")
    for row in paper.text("cross_references", "id", "where", "cites", "about").itertuples(
        index=False
    ):
        right = [
            label
            for label, shows in zip(labels.label, labels.shows, strict=True)
            if shows == row.about
        ]
        kind = row.cites.split()[0]
        named = sorted(right, key=lambda label: not label.startswith(kind))
        claim = Claim(
            f"reference.{row.id}", row.where, f"The text cites for the {row.about}", row.cites, ""
        )
        yield (
            claim,
            Recomputed(
                row.cites if row.cites in right else (named[0] if named else "nothing printed"),
                disagrees=f"A wrong reference: {row.cites} shows another thing. Read "
                f"{named[0] if named else 'none'}.",
            ),
        )


@claim_check("labels.unique")
def unique_labels(paper: Paper, claim: Claim) -> Recomputed:
    counts = paper.text("labels", "label").label.value_counts()
    twice = sorted(counts.index[counts > 1])
    return Recomputed(
        len(twice),
        disagrees=f"{', '.join(twice)} stands over two things: a citation of it is ambiguous.",
    )
