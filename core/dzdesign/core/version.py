"""The version of dzdesign, stated once; the build reads it here."""

__version__ = "1.0.0"
