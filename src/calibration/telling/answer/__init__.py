"""The answer of a study, told once: answer.json, from which the page's first screen, the heads of
the exports, the terminal's last lines and `Study.answer` are made."""
