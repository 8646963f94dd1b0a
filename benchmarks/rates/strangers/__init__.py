"""Tables of measurements that a stranger could have made, and whether the diagnosis says what is
wrong with them.

`nature` holds closed forms and scipy, `plans` what a laboratory sets, `cases` the tables with what
is true of them, `ask` the one call of the diagnosis, `score` the rates. Nothing but `ask` knows the
project.
"""
