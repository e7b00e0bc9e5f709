"""Pressure inputs: recorded pressure drops and the engineer's choice -> which input is ahead, and what is said.

`negative_drop` decides it for negative commands; `not_covered` says what a verdict therefore leaves open.
"""
