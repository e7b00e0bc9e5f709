"""Offset: what the law puts out at zero command above the tests, and where its transition ends."""
