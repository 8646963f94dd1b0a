"""The paper's bench tests (2.3.2 to 2.3.4) as virtual experiments."""
