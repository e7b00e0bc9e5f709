"""Structured Text, read by a parser of its own and tried on every input; shares no code with what prints it."""
