"""The command line: its commands, their parsing, and the handling of errors."""
