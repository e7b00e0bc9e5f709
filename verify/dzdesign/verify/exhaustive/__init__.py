"""Exhaustive: the compiled core on every input against the exactly rounded law."""
