"""Identify: ramp tests enter, a `ValveModel` (the artefact valve.json) leaves.

May be touched: `read_ramp_file`, `identify`, `ValveModel`.
"""
