"""What a study is before any run: its configuration, its factors, its stages, and how a new one is
begun."""
