"""The paper's study: its data, the audit of its printed figures and their reproduction by our
runs."""
