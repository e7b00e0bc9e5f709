"""Binary formats, one module each: its `FORMATS` is found by `binary_table`, so a new format is one more module."""
