"""The paper's scaling claim (1.2): dimensional analysis, runs at several scales, and what holds."""
