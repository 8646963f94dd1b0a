"""One posterior over all tests of a laboratory: likelihood, criticism of itself, diagnostics, the
next test. Arrays in, arrays out; no configuration and no runs."""
