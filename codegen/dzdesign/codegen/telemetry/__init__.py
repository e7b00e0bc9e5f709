"""Telemetry: the frame that a firmware sends, stated once, and recordings made of frames."""
