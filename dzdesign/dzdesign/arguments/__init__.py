"""What each stage takes: a frozen dataclass of options, each declared once, for command line, options file and API."""
