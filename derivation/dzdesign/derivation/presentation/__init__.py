"""Presentation: the account enters; text, HTML and JSON leave."""
