"""Free laws: in each slot of the contact and of the reading a curve of a state, found by predicting
left-out levels.

`readings` holds the data, `slots` the curves that are tried, `mixed` their likelihoods and held-out
scores, `forms` the named curves, `choose` the decision, `found` what is told of it.
"""
