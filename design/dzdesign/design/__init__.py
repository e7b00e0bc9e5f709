"""Design: a `ValveModel` and the choices of an engineer enter, a `Compensator` leaves.

A `Compensator` is the law with exact rational coefficients, and the certificate that goes with them.
"""
