"""No dashpot: the normal law alone, which may dissipate by its own loading path."""

from dem.contact.law import Law

LAW = Law(slot="damping", name="none", equation="no dashpot")
