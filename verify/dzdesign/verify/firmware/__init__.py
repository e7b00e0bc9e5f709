"""The firmware folder: that it is whole, that manifest, board files and headers belong together."""
