"""No resistance to spin about the normal of the contact."""

from dem.contact.law import Law

LAW = Law(slot="torsion", name="none", equation="no torque about the normal")
