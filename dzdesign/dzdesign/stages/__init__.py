"""Each stage once: a dataclass of its arguments, and the function that runs it and writes what they name."""
