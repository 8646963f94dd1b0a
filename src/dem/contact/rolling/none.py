"""No resistance to rolling."""

from dem.contact.law import Law

LAW = Law(
    slot="rolling",
    name="none",
    equation="no torque",
    edem="Hertz-Mindlin (no slip), rolling friction 0",
)
