"""Design: a `ValveModel` and the choices of an engineer enter, a `Compensator` leaves.

A `Compensator` is the law with exact rational coefficients, and the certificate that goes with them.
"""

if __name__ != "dzdesign.design":
    raise ImportError("import this room as dzdesign.design: a top-level 'design' may be another package")
