"""The command line: what can be said, how it is parsed, what an error becomes."""
