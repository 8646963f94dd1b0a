"""No attraction."""

from dem.contact.law import Law

LAW = Law(slot="cohesion", name="none", equation="no attraction", default=True)
