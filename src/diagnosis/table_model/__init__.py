"""One additive Gaussian model of a whole table of single contacts, to which terms are added one
after another: laws, errors of the set-up, single rows."""
