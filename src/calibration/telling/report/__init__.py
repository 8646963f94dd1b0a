"""The study's report: one HTML file that opens offline."""
