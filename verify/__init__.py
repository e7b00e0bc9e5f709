"""Verify: firmware enters, evidence leaves: every input against the exact law, and the closed loop.

Imports nothing from codegen: the checker shares no code with what it checks.
"""

if __name__ != "dzdesign.verify":
    raise ImportError("import this room as dzdesign.verify: a top-level 'verify' may be another package")
