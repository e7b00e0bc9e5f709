"""Presentation: the account enters; text, LaTeX, HTML and JSON leave."""
