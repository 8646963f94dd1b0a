"""One posterior over the tests of a laboratory, or of the chain's one test: runs for all rigs, the
posterior with its criticism, and the test to make next."""
