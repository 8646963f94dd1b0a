"""Free laws: in each slot of the contact and of the reading a curve of a state, found by predicting
left-out levels.

`readings` holds the data, `slots` the curves that are tried and the named ones, `known` those of
the catalogue's mechanisms, `engine_gain` the engine's law in a slot and what it gains.
"""
