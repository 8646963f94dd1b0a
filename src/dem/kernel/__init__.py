"""The time step and what it is made of, compiled."""
