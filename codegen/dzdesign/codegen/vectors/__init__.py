"""Test vectors: a `Compensator` and their number in, codes with the exact law's answers out, as vectors.csv.

The answers come from the rationals of compensator.json, never from running the C.
"""
