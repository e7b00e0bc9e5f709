"""Verify: firmware enters, evidence leaves: every input against the exact law, and the closed loop.

Imports nothing from codegen: the checker shares no code with what it checks.
"""
