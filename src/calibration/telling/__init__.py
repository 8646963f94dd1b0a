"""How results reach people and other programs: the page, exports, the page of a running study, and
what the terminal shows."""
