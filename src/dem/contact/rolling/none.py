"""No resistance to rolling."""

from dem.contact.export import Export
from dem.contact.law import Law

LAW = Law(
    slot="rolling",
    name="none",
    equation="no torque",
    exports={
        "edem": Export("Hertz-Mindlin (no slip), rolling friction 0"),
        "rocky": Export("none"),
    },
)
