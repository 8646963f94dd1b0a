"""The atlas: kept runs of common tests, told without units, and emulators of a study's tests by the
nearest of them."""
