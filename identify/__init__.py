"""Identify: ramp tests enter, a `ValveModel` (the artefact valve.json) leaves.

May be touched: `read_ramp_file`, `identify`, `ValveModel`.
"""

if __name__ != "dzdesign.identify":
    raise ImportError("import this room as dzdesign.identify: a top-level 'identify' may be another package")
