"""Tables 6 and 7: the Plackett-Burman runs, effects and significance."""

import numpy as np

from calibration.statistics.equivalence import limits
from calibration.statistics.screening import screen
from paper.reproduction import margins
from paper.reproduction.chain import spread
from paper.reproduction.rows import (
    NOT_COMPARABLE,
    NOT_RUN,
    Place,
    absent,
    estimates,
    matters,
    printed_of,
    single_run,
    words,
)

CODES = list("ABCDEFG")
RESPONSE = "angle_deg"


def rows(paper, study):
    """Rows of Tables 6 and 7."""
    runs, summary = study.table("screening", "runs"), study.summary("screening")
    if runs is None or summary is None:
        for item, what in (("Table 6", "screening runs"), ("Table 7", "effects")):
            yield absent(
                Place(item, f"{item.lower().replace(' ', '0')}", what), None, NOT_RUN, "screening"
            )
        return
    yield from _runs(paper, study, runs)
    yield from _effects(paper, study, runs, summary)


def _runs(paper, study, runs):
    table = paper.numbers("table06_plackett_burman", *CODES, RESPONSE)
    angles = paper.printed("table06_plackett_burman", RESPONSE)
    same = (
        set(CODES) <= set(runs)
        and len(runs) == len(table)
        and np.allclose(runs[CODES], table[CODES])
    )
    scatter = spread(paper, study)
    for k, text in enumerate(angles):
        place = Place("Table 6", f"table06.run{k + 1}", f"angle of run {k + 1}", "deg", study.name)
        if same:
            yield single_run(place, text, float(runs["response"][k]), *scatter)
        else:
            yield absent(place, text.text, NOT_COMPARABLE, "this study ran another design")


def _effects(paper, study, runs, summary):
    table = paper.numbers("table06_plackett_burman", *CODES, RESPONSE)
    theirs = screen(table, CODES, table[RESPONSE])
    effect = theirs.table.set_index("code")["effect"]
    t = theirs.table.set_index("code")["t"]
    ours = study.table("screening", "effects").set_index("code")
    names = paper.text("table05_contact_parameter_ranges", "factor", "name").set_index("factor")[
        "name"
    ]
    printed_p = paper.text("table07_plackett_burman_anova", "source", "p").set_index("source")["p"]
    alpha = summary["alpha"]
    valued = min(len(table), runs["response"].count())
    freedom = max(valued - 1 - len(CODES), 1)
    for code in CODES:
        name = names[code]
        if code not in ours.index or ours.loc[code, "name"] != name:
            place = Place("Table 7", f"table07.{code}", f"effect of {name}", "deg", study.name)
            yield absent(place, None, NOT_COMPARABLE, "no factor of this study")
            continue
        readable = name.replace("_", " ")
        place = Place(
            "Table 7", f"table07.{code}.effect", f"effect of {readable}", "deg", study.name, True
        )
        mine = float(ours.loc[code, "effect"])
        own_se, their_se = (
            abs(e / x) for e, x in ((mine, ours.loc[code, "t"]), (effect[code], t[code]))
        )
        yield estimates(place, printed_of(float(effect[code]), 2), mine, own_se, freedom, their_se)
        place = Place(
            "Table 7", f"table07.{code}.p", f"{readable} significant at {alpha:g}", "1", study.name
        )
        ours_too = matters(
            summary["p"][name], alpha, *limits(mine, own_se, freedom), margins.ANGLE_DEG
        )
        said = "yes" if printed_of(printed_p[code].lstrip("<")).value < alpha else "no"
        yield words(place, said, ours_too, f"p {printed_p[code]} and {summary['p'][name]:.2g}")
