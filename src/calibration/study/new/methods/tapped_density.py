"""Bulk density of grains in a vessel that was tapped."""

from calibration.study.new.grains import Grains
from calibration.study.new.methods.bulk_density import assumed, doubts_of_packing, vessel
from calibration.study.new.methods.declare import Entry, LaboratoryTest, Method, Question, rows_of

MOST_TAPS = 100
"""Taps of a run at most; each is a quarter of a second of simulated time."""


def becomes(entry: Entry, grains: Grains) -> LaboratoryTest:
    """The experiment `bulk_density` with the laboratory's taps; more than MOST_TAPS are kept as
    data that no run is compared with."""
    doubts = doubts_of_packing(entry, "density", grains)
    run, went = vessel(entry, grains)
    taps = int(entry.value("taps"))
    run["geometry"] |= {"taps": min(taps, MOST_TAPS), "tap_height_mm": entry.value("height", 3.0)}
    rows = rows_of(entry, "density", "bulk_density", "tapped_density", "kg/m3")
    places = {"density": "a target", "taps": "as given"}
    if taps > MOST_TAPS:
        rows = [row | {"role": "hold out"} for row in rows]
        places |= {
            "density": f"kept, and no target: {taps} taps are not simulated, {MOST_TAPS} are",
            "taps": f"not the rig's, which has {MOST_TAPS}",
        }
    if entry.values("height"):
        places["height"] = "as given"
    if entry.values("vessel"):
        places["vessel"] = went
    metric = "tapped_density_kg_m3"
    if taps > MOST_TAPS:
        said = (*doubts, places["density"] + f". Measure it after {MOST_TAPS} taps as well")
        return LaboratoryTest("tapped", "bulk_density", run, rows, (), places, said=said)
    discrepancy, said = assumed(entry, grains, run, metric)
    return LaboratoryTest(
        "tapped", "bulk_density", run, rows, (metric,), places, discrepancy, said=doubts + said,
    )  # fmt: skip


METHOD = Method(
    name="tapped-density",
    title="Bulk density, tapped",
    about="The vessel is dropped from a small height again and again (ISO 3953).",
    questions=(
        Question("density", "mass over volume, each reading", "tapped_density_kg_m3",
                 reading=True, needed=True, example="810 kg/m3",
                 headings=("bulk density", "stampfdichte", "masse volumique tassée")),
        Question("taps", "number of taps", whole=True, least=1, most=10000, needed=True,
                 example="100"),
        Question("height", "height of each tap", "tap_height_mm", example="3 mm"),
        Question("vessel", "inner diameter of the vessel", "inner_diameter_mm", example="100 mm"),
    ),
    rank=21,
    becomes=becomes,
    spread=True,
)  # fmt: skip
