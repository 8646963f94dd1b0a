"""Grains in a vacuum."""

from dem.contact.law import Law

LAW = Law(slot="drag", name="none", equation="no drag", default=True)
