"""Tables of measurements that a stranger could have made, and whether the diagnosis says what is
wrong with them.

`nature` holds closed forms and scipy, `plans` what a laboratory sets, `cases` the tables with what
is true of them, `ask` the one call of the diagnosis, `score` the rates. Nothing but `ask` knows the
project.

    cd tests/discovery
    python -m strangers list              every case of the campaign
    python -m strangers show CASE         its table and what is true of it
    python -m strangers try CASE|KIND ..  asks the diagnosis; prints what it says and the marks
    python -m strangers engine CASE ..    asks the engine as well, and prints the laws' gains
    python -m strangers gains             asks the engine as well, of 24 cases fixed beforehand
    python -m strangers run [PART PARTS]  the cases that the kept file lacks
    python -m strangers score [FILE]      its rates, and the cases that count against them
    python -m strangers table             writes the rates into the documentation
"""
