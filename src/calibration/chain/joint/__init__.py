"""One posterior over all tests of a laboratory: common runs for all rigs, the posterior with its
criticism, and the test to make next."""
