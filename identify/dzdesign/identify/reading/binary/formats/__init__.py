"""File formats, one module each: its `FORMATS` is found by `registry`, so that a new format is one more module."""
