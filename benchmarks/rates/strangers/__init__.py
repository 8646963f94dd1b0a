"""Tables of measurements that a stranger could have made, and whether the diagnosis says what is
wrong with them.

`nature` has the laws of laws.csv and scipy, `plans` what a laboratory sets, `cases` the tables with
what is true of them (kinds.yaml, campaign.yaml), `ask` the one call of the diagnosis, `score` the
marks. Nothing but `ask` knows the project.
"""
